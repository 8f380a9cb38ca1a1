/* A library for LD_PRELOAD: counts the calls by which a program writes below a folder, and makes one of them fail, stop
 * half-way or be the last.
 *
 * DOSE3_FAULT_FOLDER  the folder; relative paths count as below it
 * DOSE3_FAULT_LOG     a file with a line for each such call
 * DOSE3_FAULT_AT      the call that is struck, from 1; 0 for none
 * DOSE3_FAULT         kill (before the call), after (kill behind it), half (a write of half the bytes, then kill),
 *                     eio (the call fails), enospc (it and all that need space after it fail), short (a write of half
 *                     the bytes), eintr (a signal comes in between)
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { FILES = 4096 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static char written[FILES];
static long calls, at;
static int log_file = -1;
static const char *folder, *kind = "";

__attribute__((constructor)) static void begin(void) {
    const char *text;
    folder = getenv("DOSE3_FAULT_FOLDER");
    if ((text = getenv("DOSE3_FAULT"))) kind = text;
    if ((text = getenv("DOSE3_FAULT_AT"))) at = atol(text);
    if ((text = getenv("DOSE3_FAULT_LOG")))
        log_file = (int)syscall(SYS_openat, AT_FDCWD, text, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
}

static int below(const char *path) {
    if (!folder) return 0;
    return path[0] != '/' || strncmp(path, folder, strlen(folder)) == 0;
}

static int is(const char *name) { return strcmp(kind, name) == 0; }

static void die(void) { syscall(SYS_kill, syscall(SYS_getpid), SIGKILL); }

/* What happens to a call. */
enum fate { RUN, FAIL, HALF, LAST };

/* Counts a call; `needs_space` where a full disk stops it, `repeats` where a signal may interrupt it. */
static enum fate count(const char *what, const char *path, int needs_space, int repeats) {
    char line[512];
    pthread_mutex_lock(&lock);
    long n = ++calls;
    pthread_mutex_unlock(&lock);
    if (log_file >= 0) {
        int length = snprintf(line, sizeof line, "%ld %s %s\n", n, what, path);
        if (length >= (int)sizeof line) length = sizeof line - 1;
        syscall(SYS_write, log_file, line, (size_t)length);
    }
    /* Files can be removed from a full disk. */
    int stops = needs_space || (n == at && strcmp(what, "unlink"));
    if (is("enospc") && at && n >= at && stops) {
        errno = ENOSPC;
        return FAIL;
    }
    if (n != at) return RUN;
    if (is("kill")) die();
    if (is("eio")) { errno = EIO; return FAIL; }
    if (is("eintr") && repeats) { errno = EINTR; return FAIL; }
    if (is("after")) return LAST;
    if (is("half")) return strcmp(what, "write") ? LAST : HALF;
    if (is("short")) return HALF;
    return RUN;
}

static void note(int file, int on) {
    if (file >= 0 && file < FILES) written[file] = (char)on;
}

static int noted(int file) { return file >= 0 && file < FILES && written[file]; }

static int open_with(int at_folder, const char *path, int flags, mode_t mode) {
    int writes = (flags & O_ACCMODE) != O_RDONLY && below(path);
    enum fate fate = writes ? count("open", path, (flags & O_CREAT) != 0, 1) : RUN;
    if (fate == FAIL) return -1;
    int file = (int)syscall(SYS_openat, at_folder, path, flags, mode);
    note(file, writes);
    if (fate == LAST) die();
    return file;
}

#define MODE(mode, flags)                            \
    mode_t mode = 0;                                 \
    if ((flags) & (O_CREAT | __O_TMPFILE)) {         \
        va_list rest;                                \
        va_start(rest, flags);                       \
        mode = va_arg(rest, mode_t);                 \
        va_end(rest);                                \
    }

int open(const char *path, int flags, ...) { MODE(mode, flags) return open_with(AT_FDCWD, path, flags, mode); }
int open64(const char *path, int flags, ...) { MODE(mode, flags) return open_with(AT_FDCWD, path, flags, mode); }
int openat(int in, const char *path, int flags, ...) { MODE(mode, flags) return open_with(in, path, flags, mode); }
int openat64(int in, const char *path, int flags, ...) { MODE(mode, flags) return open_with(in, path, flags, mode); }

ssize_t write(int file, const void *bytes, size_t length) {
    enum fate fate = noted(file) ? count("write", "", 1, 1) : RUN;
    if (fate == FAIL) return -1;
    if (fate == HALF && length > 1) length /= 2;
    ssize_t done = syscall(SYS_write, file, bytes, length);
    if (fate == LAST || (fate == HALF && is("half"))) die();
    return done;
}

/* One call is one fate: the parts become a single write. */
ssize_t writev(int file, const struct iovec *parts, int number) {
    if (!noted(file)) return syscall(SYS_writev, file, parts, number);
    for (int i = 0; i < number; i++)
        if (parts[i].iov_len) return write(file, parts[i].iov_base, parts[i].iov_len);
    return 0;
}

static int sync_with(long call, int file) {
    enum fate fate = noted(file) ? count("fsync", "", 1, 1) : RUN;
    if (fate == FAIL) return -1;
    int done = (int)syscall(call, file);
    if (fate == LAST) die();
    return done;
}

int fsync(int file) { return sync_with(SYS_fsync, file); }
int fdatasync(int file) { return sync_with(SYS_fdatasync, file); }

int flock(int file, int operation) {
    enum fate fate = noted(file) ? count("flock", "", 0, 0) : RUN;
    if (fate == FAIL) return -1;
    int done = (int)syscall(SYS_flock, file, operation);
    if (fate == LAST) die();
    return done;
}

int rename(const char *from, const char *to) {
    enum fate fate = below(to) ? count("rename", to, 0, 0) : RUN;
    if (fate == FAIL) return -1;
    int done = (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
    if (fate == LAST) die();
    return done;
}

int unlink(const char *path) {
    enum fate fate = below(path) ? count("unlink", path, 0, 0) : RUN;
    if (fate == FAIL) return -1;
    int done = (int)syscall(SYS_unlinkat, AT_FDCWD, path, 0);
    if (fate == LAST) die();
    return done;
}

int mkdir(const char *path, mode_t mode) {
    struct stat there;
    /* Folders that are there cost nothing. */
    int makes = below(path) && stat(path, &there) != 0;
    enum fate fate = makes ? count("mkdir", path, 1, 0) : RUN;
    if (fate == FAIL) return -1;
    int done = (int)syscall(SYS_mkdirat, AT_FDCWD, path, mode);
    if (fate == LAST) die();
    return done;
}

int close(int file) {
    note(file, 0);
    return (int)syscall(SYS_close, file);
}
