/* Runs the threads of a launch on the host. A translated module (translate.py) includes this file.

   Threads run one after another, in the order that EMULATOR_ORDER names: forward, reverse or random
   (EMULATOR_SEED). Threads of a kernel with barriers run block by block, each on a stack of its own,
   from barrier to barrier; all of a block must reach each of them. Compiled with -DRACES, it records
   who reads and writes which four bytes in a launch, and reports two threads of which one writes,
   unless a barrier separates them. */
#define _GNU_SOURCE
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <ucontext.h>

typedef struct {
  unsigned tid, ctaid, ntid, nctaid;
  int64_t id;       /* in the whole launch */
  unsigned phase;   /* barriers that it has passed */
  unsigned carry;   /* of the last sum that left one */
  const char *name; /* of the kernel */
} Thread;
typedef void (*Kernel)(Thread *, void **);
/* a register as whatever type an instruction takes it for */
typedef union {
  uint8_t pred, b8, u8; uint16_t b16, u16; uint32_t b32, u32; uint64_t b64, u64;
  int8_t s8; int16_t s16; int32_t s32; int64_t s64; float f32; double f64;
} Register;

static void emu_stop(const char *why) {
  fprintf(stderr, "emulator: %s\n", why);
  abort();
}

/* a device stops at the address of n bytes that is no multiple of n */
static inline void emu_aligned(Thread *T, uint64_t a, unsigned n) {
  if (a % n == 0) return;
  fprintf(stderr, "emulator: %s: misaligned address of %u bytes\n", T->name, n);
  abort();
}

/* -- arithmetic as the device does it -- */

static inline double as_f64(uint64_t a) { double d; memcpy(&d, &a, 8); return d; }
static inline uint64_t as_u64(double a) { uint64_t d; memcpy(&d, &a, 8); return d; }
static inline float as_f32(uint32_t a) { float d; memcpy(&d, &a, 4); return d; }
/* numbers below the normal ones are zero with .ftz */
static inline float ftz(float a) { return fabsf(a) < FLT_MIN ? copysignf(0.0f, a) : a; }
#define unordered(a, b) ((a) != (a) || (b) != (b))
#define HIGH_WORD 0xffffffff00000000ull
/* 20 bits of the mantissa: the low word is zero */
static inline double rcp_approx_f64(double a) {
  return as_f64(as_u64(1.0 / as_f64(as_u64(a) & HIGH_WORD)) & HIGH_WORD);
}
/* Functions that a device approximates. A result is off by the largest error that the PTX ISA (9.1,
   sections 9.7.3.8 to 9.7.3.21) allows, upwards or downwards by its bits and EMULATOR_APPROXIMATE, a
   number, or always "up" or "down". A device is closer, but how close is not documented. */
static float off_by(double exact, double error) {
  static int side = 2;
  static uint64_t seed;
  if (side == 2) {
    const char *name = getenv("EMULATOR_APPROXIMATE");
    side = name && !strcmp(name, "up") ? 1 : name && !strcmp(name, "down") ? -1 : 0;
    seed = name && !side ? atol(name) : 0;
  }
  float nearest = exact;
  if (!isfinite(nearest) || exact == 0.0) return nearest;
  int up = side ? side > 0 : ((as_u64(exact) ^ seed * 0xD1B54A32D192ED03ull) * 0x9E3779B97F4A7C15ull >> 40) & 1;
  float out = exact + (up ? error : -error);
  /* the last number within the error */
  return fabs(out - exact) <= error ? out : nextafterf(out, nearest);
}
/* distance of the numbers of single precision at this one */
static double ulp(double a) { int e; frexp(a, &e); return ldexp(1.0, (e > -125 ? e : -125) - 24); }
static float ulps(double exact, double n) { return off_by(exact, n * ulp(exact)); }
static float rcp_approx_f32(float a) { return ftz(ulps(1.0 / ftz(a), 1)); }
static float div_approx_f32(float a, float b) {
  int overflows = fabsf(b) > 0x1p126f && isfinite(b);
  return overflows ? copysignf(1.0f, b) * a * 0.0f : ulps((double)a / b, 2);
}
static float div_full_f32(float a, float b) { return ulps((double)a / b, 2); }
static float rsqrt_approx_f32(float a) { double d = 1.0 / sqrt(a); return off_by(d, d * exp2(-22.9)); }
static double rsqrt_approx_f64(double a) { return 1.0 / sqrt(a); }
static float sqrt_approx_f32(float a) { double d = sqrt(a); return off_by(d, d * 0x1p-23); }
static float ex2_approx_f32(float a) { return ulps(exp2f(a), 2); }
static float lg2_approx_f32(float a) {
  double d = log2(a);
  return off_by(d, (a > 0.5f && a < 2.0f ? 1.0 : fabs(d)) * 0x1p-22);
}
static float wave_off(double exact, float angle) {
  return off_by(exact, fabsf(angle) <= 2 * M_PI ? exp2(-20.5) : exp2(-14.7));
}
static float sin_approx_f32(float a) { return a == 0.0f ? a : wave_off(sin(a), a); }
static float cos_approx_f32(float a) { return wave_off(cos(a), a); }
#define SATURATE(name, type, low, high) \
  static inline type sat_##name(double a) { \
    return a != a ? 0 : a <= (double)(low) ? (low) : a >= (double)(high) ? (high) : (type)a; \
  }
SATURATE(s64, int64_t, INT64_MIN, INT64_MAX)
SATURATE(u64, uint64_t, 0, UINT64_MAX)
SATURATE(s32, int32_t, INT32_MIN, INT32_MAX)
SATURATE(u32, uint32_t, 0, UINT32_MAX)
SATURATE(s16, int16_t, INT16_MIN, INT16_MAX)
SATURATE(u16, uint16_t, 0, UINT16_MAX)
SATURATE(u8, uint8_t, 0, UINT8_MAX)
static inline unsigned clz_b32(uint32_t a) { return a ? __builtin_clz(a) : 32; }
static inline unsigned clz_b64(uint64_t a) { return a ? __builtin_clzll(a) : 64; }
static inline uint32_t prmt(uint32_t a, uint32_t b, uint32_t chosen) {
  uint64_t both = a | ((uint64_t)b << 32);
  uint32_t out = 0;
  for (int i = 0; i < 4; i++) {
    unsigned s = (chosen >> (4 * i)) & 15;
    uint8_t byte = both >> (8 * (s & 7));
    if (s & 8) byte = (byte & 128) ? 255 : 0;
    out |= (uint32_t)byte << (8 * i);
  }
  return out;
}
static inline uint32_t bfe_u32(uint32_t a, uint32_t first, uint32_t n) {
  return first > 31 ? 0 : (a >> first) & (n > 31 ? ~0u : (1u << n) - 1);
}
static inline uint64_t bfe_u64(uint64_t a, uint32_t first, uint32_t n) {
  return first > 63 ? 0 : (a >> first) & (n > 63 ? ~0ull : (1ull << n) - 1);
}
static inline int32_t bfe_s32(int32_t a, uint32_t first, uint32_t n) {
  return n == 0 ? 0 : (int32_t)((uint32_t)a << (32 - first - n)) >> (32 - n);
}

/* -- races -- */

#ifdef RACES
typedef struct { int64_t id; unsigned block, phase; } Touch;
typedef struct {
  uint64_t word;
  uint32_t launch;
  Touch reader, writer;   /* the last of each; id -1: none */
  uint8_t blocks, threads; /* read by several blocks, by several threads of the last phase */
  uint8_t atomic;
} Shadow;
#define SLOTS (1u << 22)
static Shadow *table;
static uint32_t launch, filled;
static int watched;

static void race(Thread *T, const char *what, Touch *other, int same) {
  static char known[256][200];
  static int count;
  char line[200];
  snprintf(line, sizeof line, "RACE %s: %s%s", T->name, what, same ? ", same value" : "");
  for (int i = 0; i < count; i++)
    if (!strcmp(known[i], line)) return;
  if (count < 256) strcpy(known[count++], line);
  fprintf(stderr, "%s (threads %ld and %ld)\n", line, (long)T->id, (long)other->id);
}
static Shadow *slot(uint64_t word) {
  for (uint64_t h = (word * 0x9E3779B97F4A7C15ull) >> 42;; h = (h + 1) & (SLOTS - 1)) {
    Shadow *s = &table[h];
    if (s->launch != launch) {
      if (++filled > SLOTS / 2) emu_stop("the table of races is full");
      memset(s, 0, sizeof *s);
      s->launch = launch, s->word = word, s->reader.id = s->writer.id = -1;
      return s;
    }
    if (s->word == word) return s;
  }
}
/* whether nothing orders what another thread did before what this one does */
static int beside(Thread *T, Touch *other) {
  if (other->id < 0 || other->id == T->id) return 0;
  return other->block != T->ctaid || other->phase == T->phase;
}
static void emu_read(Thread *T, uint64_t a, int n, uint64_t space) {
  if (!watched) return;
  for (uint64_t w = a / 4; w <= (a + n - 1) / 4; w++) {
    Shadow *s = slot(w ^ space);
    if (beside(T, &s->writer)) race(T, s->atomic ? "read after an atomic" : "read after a write", &s->writer, 0);
    if (s->reader.id >= 0 && s->reader.block != T->ctaid) s->blocks = 1;
    if (s->reader.phase != T->phase) s->threads = 0;
    else if (s->reader.id >= 0 && s->reader.id != T->id) s->threads = 1;
    s->reader = (Touch){T->id, T->ctaid, T->phase};
  }
}
static void after_readers(Thread *T, Shadow *s, const char *what, int same) {
  int several = s->blocks || (s->threads && s->reader.phase == T->phase);
  if (several || beside(T, &s->reader)) race(T, what, &s->reader, same);
}
static void emu_wrote(Thread *T, uint64_t a, int n, int same, uint64_t space) {
  if (!watched) return;
  for (uint64_t w = a / 4; w <= (a + n - 1) / 4; w++) {
    Shadow *s = slot(w ^ space);
    if (beside(T, &s->writer)) race(T, s->atomic ? "write after an atomic" : "write after a write", &s->writer, same);
    after_readers(T, s, "write after a read", same);
    s->atomic = 0, s->writer = (Touch){T->id, T->ctaid, T->phase};
  }
}
/* is_sum: of floating point, whose rounding depends on the order of the threads */
static void emu_atomic(Thread *T, uint64_t a, int n, int is_sum) {
  if (!watched) return;
  for (uint64_t w = a / 4; w <= (a + n - 1) / 4; w++) {
    Shadow *s = slot(w);
    if ((is_sum || !s->atomic) && beside(T, &s->writer))
      race(T, s->atomic ? "sum after an atomic" : "atomic after a write", &s->writer, 0);
    after_readers(T, s, "atomic after a read", 0);
    s->atomic = 1, s->writer = (Touch){T->id, T->ctaid, T->phase};
  }
}
static void begin_launch(const char *name) {
  if (!table) table = calloc(SLOTS, sizeof *table);
  launch++, filled = 0;
  watched = !strstr(name, "ext_arr") && !strstr(name, "fill");
}
#else
#define emu_read(T, a, n, space)
#define emu_wrote(T, a, n, same, space)
#define emu_atomic(T, a, n, is_sum)
#define begin_launch(name)
#endif
/* shared memory of two blocks is not the same */
#define SHARED_SPACE ((uint64_t)(T->ctaid + 1) << 48)

/* -- the order of threads -- */

static uint64_t scrambled(uint64_t *state) {
  *state ^= *state << 13, *state ^= *state >> 7, *state ^= *state << 17;
  return *state;
}
typedef struct { int kind; uint64_t n, mask, a, c, k, done; } Order;
static Order order_of(uint64_t n) {
  static uint64_t seed;
  const char *name = getenv("EMULATOR_ORDER");
  if (!seed) seed = 88172645463325252ull ^ (getenv("EMULATOR_SEED") ? atol(getenv("EMULATOR_SEED")) * 0x9E3779B97F4A7C15ull : 0);
  Order o = {!name ? 0 : !strcmp(name, "reverse") ? 1 : !strcmp(name, "random") ? 2 : 0, n};
  for (o.mask = 1; o.mask < n; o.mask *= 2) {}
  o.mask -= 1, o.a = (scrambled(&seed) >> 3) * 4 + 1, o.c = scrambled(&seed) | 1;
  return o;
}
/* the next of n numbers; a linear congruence with odd c visits all below a power of two once */
static uint64_t next_of(Order *o) {
  uint64_t q = o->done++;
  if (o->kind == 0) return q;
  if (o->kind == 1) return o->n - 1 - q;
  do o->k = (o->a * o->k + o->c) & o->mask; while (o->k >= o->n);
  return o->k;
}

/* -- blocks whose threads meet -- */

#define STACK (1u << 20)
typedef struct { Thread T; jmp_buf place; ucontext_t begin; int state; } Fibre; /* 0 new, 1 waits, 2 ended */
static Fibre *fibres, *running;
static jmp_buf scheduler;
static Kernel fibre_kernel;
static void **fibre_params;
static void fibre_main(void) {
  fibre_kernel(&running->T, fibre_params);
  running->state = 2;
  _longjmp(scheduler, 1);
}
static void emu_barrier(Thread *T) {
  Fibre *me = running;
  if (!me) emu_stop("a barrier that some threads of the block do not reach");
  me->state = 1;
  if (!_setjmp(me->place)) _longjmp(scheduler, 1);
  T->phase++;
}
static void go_on(Fibre *f) {
  running = f;
  if (_setjmp(scheduler)) return;
  if (f->state == 1) _longjmp(f->place, 1);
  setcontext(&f->begin);
}
static void run_block(const char *name, unsigned block, unsigned gx, unsigned bx) {
  static char *stacks;
  if (!stacks) {
    stacks = mmap(0, (size_t)1024 * STACK, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    fibres = calloc(1024, sizeof *fibres);
    if (stacks == MAP_FAILED) emu_stop("no memory for the stacks of a block");
  }
  for (unsigned t = 0; t < bx; t++) {
    Fibre *f = &fibres[t];
    f->T = (Thread){t, block, bx, gx, (int64_t)block * bx + t, 0, name}, f->state = 0;
    if (t && fibres[0].state == 2) { /* the first thread has met no barrier: nor may the others */
      running = 0;
      fibre_kernel(&f->T, fibre_params);
      f->state = 2;
      continue;
    }
    getcontext(&f->begin);
    f->begin.uc_stack.ss_sp = stacks + (size_t)t * STACK, f->begin.uc_stack.ss_size = STACK;
    makecontext(&f->begin, fibre_main, 0);
    if (!t) go_on(f);
  }
  if (fibres[0].state == 2) return;
  for (unsigned ended = 0, met = 1; ended < bx; met = 0) {
    Order order = order_of(bx);
    for (unsigned q = 0; q < bx; q++) {
      unsigned t = next_of(&order);
      if (t || !met) go_on(&fibres[t]); /* the first thread waits at the first barrier already */
    }
    ended = 0;
    for (unsigned t = 0; t < bx; t++) ended += fibres[t].state == 2;
    if (ended && ended < bx) emu_stop("a barrier that some threads of the block do not reach");
  }
}

static void emu_run(const char *name, Kernel kernel, void **params, unsigned gx, unsigned bx, int meets) {
  if (strstr(name, "initialize_rand_states")) return;
  begin_launch(name);
  Order order = order_of(meets ? gx : (uint64_t)gx * bx);
  if (meets) {
    fibre_kernel = kernel, fibre_params = params;
    for (uint64_t q = 0; q < order.n; q++) run_block(name, next_of(&order), gx, bx);
    return;
  }
  for (uint64_t q = 0; q < order.n; q++) {
    uint64_t id = next_of(&order);
    Thread T = {id % bx, id / bx, bx, gx, (int64_t)id, 0, name};
    kernel(&T, params);
  }
}
