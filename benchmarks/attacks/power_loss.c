/* Records what a program asks of the files in one folder: LD_PRELOAD for benchmarks.attacks.power_loss.

   POWER_FOLDER is the folder, POWER_LOG the file that gets one record per call: the head below, the
   path, and for a write its bytes. The calls themselves are passed on unchanged. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

struct head {
    double time; /* CLOCK_MONOTONIC, s */
    uint64_t offset, length;
    uint32_t path;
    char kind; /* C create, W write, T truncate, S sync, U unlink */
    char unused[3];
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static void record(char kind, const char *path, uint64_t offset, uint64_t length, const void *data)
{
    static int log = -2;
    int before = errno;
    struct timespec now;
    pthread_mutex_lock(&lock);
    if (log == -2) {
        const char *place = getenv("POWER_LOG");
        log = place ? (int)syscall(SYS_openat, AT_FDCWD, place, O_WRONLY | O_CREAT | O_APPEND, 0600) : -1;
    }
    clock_gettime(CLOCK_MONOTONIC, &now);
    struct head head = {now.tv_sec + 1e-9 * now.tv_nsec, offset, length, strlen(path), kind, {0}};
    struct iovec parts[3] = {
        {&head, sizeof head}, {(void *)path, head.path}, {(void *)data, data ? length : 0}};
    if (log >= 0) syscall(SYS_writev, log, parts, 3);
    pthread_mutex_unlock(&lock);
    errno = before;
}

static int inside(const char *path)
{
    const char *folder = getenv("POWER_FOLDER");
    return folder && !strncmp(path, folder, strlen(folder)) && !strstr(path, "(deleted)");
}

/* The path of an open file of the folder, or 0. */
static const char *path_of(int file, char *path)
{
    char link[64];
    int before = errno;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, PATH_MAX - 1);
    errno = before;
    if (length <= 0) return 0;
    path[length] = 0;
    return inside(path) ? path : 0;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int opened(int file, int flags, int new)
{
    char path[PATH_MAX];
    if (file >= 0 && path_of(file, path)) {
        if (new) record('C', path, 0, 0, 0);
        if (flags & O_TRUNC) record('T', path, 0, 0, 0);
    }
    return file;
}

#define OPEN(name)                                                                     \
    int name(const char *path, int flags, ...)                                         \
    {                                                                                  \
        va_list rest;                                                                  \
        va_start(rest, flags);                                                         \
        mode_t mode = flags & O_CREAT ? va_arg(rest, mode_t) : 0;                      \
        va_end(rest);                                                                  \
        int new = flags & O_CREAT && syscall(SYS_faccessat, AT_FDCWD, path, F_OK) != 0; \
        return opened(REAL(name)(path, flags, mode), flags, new);                      \
    }
OPEN(open)
OPEN(open64)

ssize_t write(int file, const void *data, size_t size)
{
    char path[PATH_MAX];
    off_t place = path_of(file, path) ? lseek(file, 0, SEEK_CUR) : -1;
    ssize_t done = REAL(write)(file, data, size);
    if (place >= 0 && done > 0) record('W', path, place, done, data);
    return done;
}

#define PWRITE(name)                                                        \
    ssize_t name(int file, const void *data, size_t size, off_t offset)     \
    {                                                                       \
        char path[PATH_MAX];                                                \
        ssize_t done = REAL(name)(file, data, size, offset);                \
        if (done > 0 && path_of(file, path)) record('W', path, offset, done, data); \
        return done;                                                        \
    }
PWRITE(pwrite)
PWRITE(pwrite64)

#define TRUNCATE(name)                                                   \
    int name(int file, off_t length)                                     \
    {                                                                    \
        char path[PATH_MAX];                                             \
        int failed = REAL(name)(file, length);                           \
        if (!failed && path_of(file, path)) record('T', path, length, 0, 0); \
        return failed;                                                   \
    }
TRUNCATE(ftruncate)
TRUNCATE(ftruncate64)

#define SYNC(name)                                                  \
    int name(int file)                                              \
    {                                                               \
        char path[PATH_MAX];                                        \
        int failed = REAL(name)(file);                              \
        if (!failed && path_of(file, path)) record('S', path, 0, 0, 0); \
        return failed;                                              \
    }
SYNC(fsync)
SYNC(fdatasync)

int unlink(const char *path)
{
    int failed = REAL(unlink)(path);
    if (!failed && inside(path)) record('U', path, 0, 0, 0);
    return failed;
}
