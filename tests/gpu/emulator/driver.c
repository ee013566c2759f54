/* A libcuda without a device: its memory is the host's. Modules are translated to C (translate.py),
   compiled and run on the host; launches, copies and synchronisations are counted.

   EMULATOR_OUT: folder of the modules (mod_0000.ptx, ...). EMULATOR_PYTHON: runs translate.py.
   EMULATOR_SMS: multiprocessors.
   EMULATOR_MEMORY_GB: memory of the device. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef int Result; /* 0: success */
typedef struct { int number; void *code; } Module;
typedef struct Function {
  Module *module;
  char name[512];
  void (*run)(void **, unsigned, unsigned);
  struct Function *next;
} Function;
static Function *functions;
static int modules;

/* what a test asks for: launches, copies to the device, from it, their bytes, synchronisations */
enum { LAUNCHES, TO_DEVICE, FROM_DEVICE, BYTES_TO, BYTES_FROM, SYNCS, COUNTS };
static long counts[COUNTS];
void emulator_counts(long *out) { memcpy(out, counts, sizeof counts); }

static const char *setting(const char *name, const char *usual) {
  const char *value = getenv(name);
  return value ? value : usual;
}
static int number(const char *name, int usual) {
  const char *value = getenv(name);
  return value ? atoi(value) : usual;
}
static const char *folder(void) { /* of this library and translate.py */
  static char out[4096];
  Dl_info info;
  if (!*out && dladdr((void *)folder, &info)) {
    strncpy(out, info.dli_fname, sizeof out - 1);
    char *end = strrchr(out, '/');
    if (end) *end = 0; else strcpy(out, ".");
  }
  return out;
}

/* -- device and context -- */

Result cuInit(unsigned f) { return 0; }
Result cuDriverGetVersion(int *v) { *v = 12040; return 0; }
Result cuGetErrorName(int e, const char **s) { *s = "EMULATOR_ERROR"; return 0; }
Result cuGetErrorString(int e, const char **s) { *s = "error of the emulator"; return 0; }
Result cuDeviceGetCount(int *n) { *n = 1; return 0; }
Result cuDeviceGet(int *d, int i) { *d = 0; return 0; }
Result cuDeviceGetName(char *s, int n, int d) { snprintf(s, n, "emulated device"); return 0; }
Result cuDeviceTotalMem_v2(size_t *n, int d) { *n = (size_t)number("EMULATOR_MEMORY_GB", 8) << 30; return 0; }
Result cuDeviceGetAttribute(int *v, int a, int d) {
  switch (a) {
    case 75: *v = 9; break; case 76: *v = 0; break;         /* compute capability */
    case 16: *v = number("EMULATOR_SMS", 2); break;
    case 1: case 2: case 3: *v = 1024; break; case 4: *v = 64; break;
    case 5: *v = 2147483647; break; case 6: case 7: *v = 65535; break;
    case 8: *v = 49152; break; case 10: *v = 32; break; case 12: case 82: *v = 65536; break;
    case 13: *v = 1980000; break; case 39: *v = 2048; break;
    case 81: *v = 233472; break; case 97: *v = 232448; break; case 106: *v = 32; break;
    case 41: case 83: case 89: case 102: case 115: *v = 1; break;
    default: *v = 0;
  }
  return 0;
}
static void *context;
Result cuCtxCreate_v2(void **c, int f, int d) { *c = context = (void *)16; return 0; }
Result cuCtxSetCurrent(void *c) { context = c; return 0; }
Result cuCtxGetCurrent(void **c) { *c = context; return 0; }
Result cuDevicePrimaryCtxRetain(void **c, int d) { *c = (void *)16; return 0; }
Result cuDevicePrimaryCtxRelease_v2(int d) { return 0; }
Result cuCtxSetLimit(int l, size_t v) { return 0; }
Result cuDeviceGetDefaultMemPool(void **p, int d) { *p = (void *)1; return 0; }
Result cuMemPoolSetAttribute(void *p, int a, void *v) { return 0; }
Result cuMemPoolTrimTo(void *p, size_t n) { return 0; }

/* -- streams and events -- */

Result cuStreamCreate(void **s, unsigned f) { *s = (void *)32; return 0; }
Result cuStreamDestroy_v2(void *s) { return 0; }
Result cuStreamSynchronize(void *s) { counts[SYNCS]++; return 0; }
Result cuCtxSynchronize(void) { counts[SYNCS]++; return 0; }
Result cuStreamWaitEvent(void *s, void *e, unsigned f) { return 0; }
Result cuEventCreate(void **e, unsigned f) { *e = (void *)48; return 0; }
Result cuEventDestroy_v2(void *e) { return 0; }
Result cuEventDestroy(void *e) { return 0; }
Result cuEventRecord(void *e, void *s) { return 0; }
Result cuEventSynchronize(void *e) { return 0; }
Result cuEventElapsedTime(float *t, void *a, void *b) { *t = 0; return 0; }

/* -- memory -- */

static Result take(void **p, size_t n) {
  if (posix_memalign(p, 4096, n + 64)) return 2;
  memset(*p, 0, n);
  return 0;
}
Result cuMemAlloc_v2(void **p, size_t n) { return take(p, n); }
Result cuMemAllocAsync(void **p, size_t n, void *s) { return take(p, n); }
Result cuMemAllocManaged(void **p, size_t n, unsigned f) { return take(p, n); }
Result cuMemAllocHost_v2(void **p, size_t n) { return take(p, n); }
Result cuMemFree_v2(void *p) { free(p); return 0; }
Result cuMemFreeAsync(void *p, void *s) { free(p); return 0; }
Result cuMemFreeHost(void *p) { free(p); return 0; }
Result cuMemAdvise(void *p, size_t n, unsigned a, unsigned d) { return 0; }
Result cuMemGetInfo_v2(size_t *f, size_t *t) { cuDeviceTotalMem_v2(t, 0); *f = *t / 2; return 0; }
/* no address is one of the device: whoever asks copies */
Result cuPointerGetAttribute(void *v, unsigned a, void *p) { return 1; }
static Result copy(void *d, const void *s, size_t n, int kind) {
  if (kind) counts[kind]++, counts[kind + BYTES_TO - TO_DEVICE] += n;
  memcpy(d, s, n);
  return 0;
}
Result cuMemcpyHtoD_v2(void *d, void *s, size_t n) { return copy(d, s, n, TO_DEVICE); }
Result cuMemcpyDtoH_v2(void *d, void *s, size_t n) { return copy(d, s, n, FROM_DEVICE); }
Result cuMemcpyDtoD_v2(void *d, void *s, size_t n) { return copy(d, s, n, 0); }
Result cuMemcpyHtoDAsync_v2(void *d, void *s, size_t n, void *q) { return copy(d, s, n, TO_DEVICE); }
Result cuMemcpyDtoHAsync_v2(void *d, void *s, size_t n, void *q) { return copy(d, s, n, FROM_DEVICE); }
Result cuMemcpyDtoDAsync_v2(void *d, void *s, size_t n, void *q) { return copy(d, s, n, 0); }
Result cuMemcpyAsync(void *d, void *s, size_t n, void *q) { return copy(d, s, n, 0); }
Result cuMemsetD8_v2(void *p, unsigned char v, size_t n) { memset(p, v, n); return 0; }
Result cuMemsetD8Async(void *p, unsigned char v, size_t n, void *s) { memset(p, v, n); return 0; }
Result cuMemsetD32_v2(uint32_t *p, uint32_t v, size_t n) { while (n--) *p++ = v; return 0; }
Result cuMemsetD32Async(uint32_t *p, uint32_t v, size_t n, void *s) { while (n--) *p++ = v; return 0; }

/* -- modules and launches -- */

Result cuModuleLoadDataEx(Module **m, const char *image, unsigned n, unsigned *options, void **values) {
  Module *k = calloc(1, sizeof *k);
  char path[4096], command[13000];
  k->number = modules++;
  snprintf(path, sizeof path, "%s/mod_%04d.ptx", setting("EMULATOR_OUT", "."), k->number);
  FILE *f = fopen(path, "w");
  if (f) fputs(image, f), fclose(f);
  *m = k;
  snprintf(command, sizeof command, "%s -S -E %s/translate.py %s", setting("EMULATOR_PYTHON", "python3"), folder(), path);
  if (system(command)) { fprintf(stderr, "emulator: %s cannot be translated\n", path); return 218; }
  strcpy(path + strlen(path) - 4, ".so");
  k->code = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!k->code) fprintf(stderr, "emulator: %s\n", dlerror());
  return k->code ? 0 : 218;
}
Result cuModuleLoadData(Module **m, const char *image) { return cuModuleLoadDataEx(m, image, 0, 0, 0); }
Result cuModuleUnload(void *m) { return 0; }
Result cuModuleGetFunction(Function **f, Module *m, const char *name) {
  for (Function *k = functions; k; k = k->next)
    if (k->module == m && !strcmp(k->name, name)) { *f = k; return 0; }
  Function *k = calloc(1, sizeof *k);
  k->module = m, k->next = functions, functions = *f = k;
  snprintf(k->name, sizeof k->name, "%s", name);
  char symbol[600];
  snprintf(symbol, sizeof symbol, "run_%s", name);
  k->run = dlsym(m->code, symbol);
  return k->run ? 0 : 500;
}
Result cuFuncGetAttribute(int *v, unsigned a, void *f) { *v = a == 4 ? 64 : a == 0 ? 1024 : 0; return 0; }
Result cuFuncSetAttribute(void *f, int a, int v) { return 0; }
Result cuOccupancyMaxActiveBlocksPerMultiprocessor(int *n, void *f, int b, size_t s) { *n = 2; return 0; }
Result cuLaunchKernel(Function *f, unsigned gx, unsigned gy, unsigned gz, unsigned bx, unsigned by,
                      unsigned bz, unsigned shared, void *stream, void **params, void **extra) {
  counts[LAUNCHES]++;
  f->run(params, gx, bx);
  return 0;
}

/* what the compilers look up and do not call here */
#define UNUSED(x) Result x(void) { fprintf(stderr, "emulator: " #x " is not there\n"); return 801; }
UNUSED(cuStreamBeginCapture_v2) UNUSED(cuLinkCreate_v2) UNUSED(cuLinkAddData_v2) UNUSED(cuLinkAddFile_v2)
UNUSED(cuLinkComplete) UNUSED(cuLinkDestroy) UNUSED(cuImportExternalMemory)
UNUSED(cuExternalMemoryGetMappedBuffer) UNUSED(cuExternalMemoryGetMappedMipmappedArray)
UNUSED(cuMipmappedArrayGetLevel) UNUSED(cuSurfObjectCreate) UNUSED(cuImportExternalSemaphore)
UNUSED(cuSignalExternalSemaphoresAsync) UNUSED(cuWaitExternalSemaphoresAsync)
UNUSED(cuGraphCreate) UNUSED(cuGraphDestroy) UNUSED(cuGraphAddNode) UNUSED(cuGraphAddEmptyNode)
UNUSED(cuGraphAddKernelNode) UNUSED(cuGraphConditionalHandleCreate) UNUSED(cuGraphInstantiate)
UNUSED(cuGraphExecDestroy) UNUSED(cuGraphLaunch)
