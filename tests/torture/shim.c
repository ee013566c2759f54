/* Calls that write below a directory fail, from the one with a given number on up to another.
 *
 * fault_set() says which, and with which error; the first is number 1, and 0 is none. Calls of
 * processes that fork from this one are counted with it. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static long *calls, first, last;
static int error;
static char below[PATH_MAX];

void fault_set(const char *folder, long from, long to, int code) {
    if (!calls)
        calls = mmap(0, sizeof *calls, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    first = from; last = to; error = code; *calls = 0;
    strncpy(below, folder, PATH_MAX - 1);
}

long fault_calls(void) { return *calls; }

static int inside(const char *path) { return below[0] && !strncmp(path, below, strlen(below)); }

static int fails(void) {
    long number = __atomic_add_fetch(calls, 1, __ATOMIC_SEQ_CST);
    if (first && number >= first && number <= last) { errno = error; return 1; }
    return 0;
}

static int fails_at(int descriptor) {
    char link[64], path[PATH_MAX];
    int kept = errno;
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t n = readlink(link, path, sizeof path - 1);
    errno = kept;
    if (n < 0) return 0;
    path[n] = 0;
    return inside(path) && fails();
}

#define REAL(name, type) static type (*real)(); if (!real) real = (type (*)())dlsym(RTLD_NEXT, name)

ssize_t write(int d, const void *b, size_t n) { REAL("write", ssize_t); return fails_at(d) ? -1 : real(d, b, n); }
ssize_t pwrite(int d, const void *b, size_t n, off_t o) { REAL("pwrite", ssize_t); return fails_at(d) ? -1 : real(d, b, n, o); }
ssize_t pwrite64(int d, const void *b, size_t n, off64_t o) { REAL("pwrite64", ssize_t); return fails_at(d) ? -1 : real(d, b, n, o); }
ssize_t writev(int d, const struct iovec *v, int n) { REAL("writev", ssize_t); return fails_at(d) ? -1 : real(d, v, n); }
int fsync(int d) { REAL("fsync", int); return fails_at(d) ? -1 : real(d); }
int ftruncate(int d, off_t n) { REAL("ftruncate", int); return fails_at(d) ? -1 : real(d, n); }
int ftruncate64(int d, off64_t n) { REAL("ftruncate64", int); return fails_at(d) ? -1 : real(d, n); }
int posix_fallocate(int d, off_t o, off_t n) { REAL("posix_fallocate", int); return fails_at(d) ? error : real(d, o, n); }
int posix_fallocate64(int d, off64_t o, off64_t n) { REAL("posix_fallocate64", int); return fails_at(d) ? error : real(d, o, n); }
ssize_t copy_file_range(int i, off64_t *a, int d, off64_t *b, size_t n, unsigned f) { REAL("copy_file_range", ssize_t); return fails_at(d) ? -1 : real(i, a, d, b, n, f); }
ssize_t sendfile(int d, int i, off_t *o, size_t n) { REAL("sendfile", ssize_t); return fails_at(d) ? -1 : real(d, i, o, n); }
ssize_t sendfile64(int d, int i, off64_t *o, size_t n) { REAL("sendfile64", ssize_t); return fails_at(d) ? -1 : real(d, i, o, n); }
int rename(const char *a, const char *b) { REAL("rename", int); return inside(b) && fails() ? -1 : real(a, b); }
int unlink(const char *p) { REAL("unlink", int); return inside(p) && fails() ? -1 : real(p); }
int rmdir(const char *p) { REAL("rmdir", int); return inside(p) && fails() ? -1 : real(p); }
int mkdir(const char *p, mode_t m) { REAL("mkdir", int); return inside(p) && fails() ? -1 : real(p, m); }

#define OPEN(name) int name(const char *p, int flags, ...) { \
    REAL(#name, int); va_list l; va_start(l, flags); mode_t m = (flags & O_CREAT) ? va_arg(l, mode_t) : 0; va_end(l); \
    return (flags & O_CREAT) && inside(p) && fails() ? -1 : real(p, flags, m); }
OPEN(open)
OPEN(open64)
