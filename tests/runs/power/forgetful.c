/* Writes down all that a program does to the files below $FORGETFUL_ROOT, so that a disk which forgets what was not
 * synced can be made from it (forgetful.py). Preloaded (LD_PRELOAD) into the program; the record goes to $FORGETFUL_LOG.
 *
 * A line of the record: operation, path, offset, length, and for writes so many bytes after the line. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int record = -2;
static const char *root;

static void note(const char *what, const char *path, long long at, size_t size, const void *data) {
    static ssize_t (*plain)(int, const void *, size_t);
    if (!plain) plain = dlsym(RTLD_NEXT, "write");
    if (record == -2) {
        const char *name = getenv("FORGETFUL_LOG");
        root = getenv("FORGETFUL_ROOT");
        int (*opening)(const char *, int, ...) = dlsym(RTLD_NEXT, "open");
        record = name && root ? opening(name, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600) : -1;
    }
    if (record < 0 || strncmp(path, root, strlen(root))) return;
    char line[PATH_MAX + 100];
    int n = snprintf(line, sizeof line, "%s %s %lld %zu\n", what, path, at, data ? size : 0);
    pthread_mutex_lock(&lock);
    plain(record, line, n);
    if (data) plain(record, data, size);
    pthread_mutex_unlock(&lock);
}

static int named(int fd, char *path) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, PATH_MAX - 1);
    path[n < 0 ? 0 : n] = 0;
    return n > 0 && path[0] == '/';
}

static void note_fd(const char *what, int fd, long long at, size_t size, const void *data) {
    char path[PATH_MAX];
    if (fd != record && named(fd, path)) note(what, path, at, size, data);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at) {
    ssize_t (*real)(int, const void *, size_t, off64_t) = dlsym(RTLD_NEXT, "pwrite64");
    ssize_t n = real(fd, data, size, at);
    if (n > 0) note_fd("write", fd, at, n, data);
    return n;
}
ssize_t pwrite(int fd, const void *data, size_t size, off_t at) { return pwrite64(fd, data, size, at); }

ssize_t write(int fd, const void *data, size_t size) {
    ssize_t (*real)(int, const void *, size_t) = dlsym(RTLD_NEXT, "write");
    off64_t at = lseek64(fd, 0, SEEK_CUR);
    ssize_t n = real(fd, data, size);
    if (n > 0 && at >= 0) note_fd("write", fd, at, n, data);
    return n;
}

int ftruncate64(int fd, off64_t size) {
    int (*real)(int, off64_t) = dlsym(RTLD_NEXT, "ftruncate64");
    int n = real(fd, size);
    if (!n) note_fd("truncate", fd, size, 0, 0);
    return n;
}
int ftruncate(int fd, off_t size) { return ftruncate64(fd, size); }

int fsync(int fd) {
    int (*real)(int) = dlsym(RTLD_NEXT, "fsync");
    int n = real(fd);
    if (!n) note_fd("sync", fd, 0, 0, 0);
    return n;
}
int fdatasync(int fd) {
    int (*real)(int) = dlsym(RTLD_NEXT, "fdatasync");
    int n = real(fd);
    if (!n) note_fd("sync", fd, 0, 0, 0);
    return n;
}

int unlink(const char *path) {
    int (*real)(const char *) = dlsym(RTLD_NEXT, "unlink");
    int n = real(path);
    if (!n) note("unlink", path, 0, 0, 0);
    return n;
}

int rename(const char *from, const char *to) {
    int (*real)(const char *, const char *) = dlsym(RTLD_NEXT, "rename");
    int n = real(from, to);
    if (!n) note("rename", from, 0, strlen(to), to);
    return n;
}
