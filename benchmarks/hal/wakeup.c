/* Library preloaded into LinuxCNC's rtapi_app: histogram of the lateness of its threads.
 *
 * rtapi_app sleeps with clock_nanosleep(TIMER_ABSTIME) on CLOCK_MONOTONIC, as cyclictest does. This library forwards the
 * call and counts the time from the due return to the reading of the clock into the file $WAKEUP: BUCKETS of one
 * nanosecond, then one bucket for later wake-ups, as 32-bit counts.
 *
 * Failures of two calls are hidden, since rtapi_app would give up real time: iopl(), which a kernel may lack and only a
 * parallel port needs, and setrlimit(), which needs CAP_SYS_RESOURCE; a thread with permission for SCHED_FIFO does not
 * need it.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#define BUCKETS 1000000

static uint32_t *count;
static int (*real_sleep)(clockid_t, int, const struct timespec *, struct timespec *);
static int (*real_iopl)(int);
static int (*real_setrlimit)(__rlimit_resource_t, const struct rlimit *);

__attribute__((constructor)) static void open_counts(void)
{
    const char *path = getenv("WAKEUP");
    int fd = path == NULL ? -1 : open(path, O_RDWR | O_CLOEXEC);
    size_t size = (BUCKETS + 1) * sizeof *count;
    void *map = fd < 0 ? MAP_FAILED : mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);

    if (map != MAP_FAILED)
        count = map;
    if (fd >= 0)
        close(fd);
    real_sleep = dlsym(RTLD_NEXT, "clock_nanosleep");
    real_iopl = dlsym(RTLD_NEXT, "iopl");
    real_setrlimit = dlsym(RTLD_NEXT, "setrlimit");
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *wake, struct timespec *left)
{
    int result = real_sleep(clock, flags, wake, left);
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    if (result == 0 && clock == CLOCK_MONOTONIC && flags == TIMER_ABSTIME && count != NULL) {
        int64_t late = (now.tv_sec - wake->tv_sec) * INT64_C(1000000000) + now.tv_nsec - wake->tv_nsec;
        count[late < 0 ? 0 : late > BUCKETS ? BUCKETS : late]++;
    }
    return result;
}

int iopl(int level)
{
    int result = real_iopl(level);

    return result < 0 && errno == ENOSYS ? 0 : result;
}

int setrlimit(__rlimit_resource_t what, const struct rlimit *limit)
{
    int result = real_setrlimit(what, limit);

    return result < 0 && errno == EPERM ? 0 : result;
}
