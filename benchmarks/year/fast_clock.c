/* A clock that a benchmark drives, for processes that preload this library.
 *
 *     monotonic = base + rate * (machine's clock - then), at most `ahead` beyond base
 *     wall      = monotonic + offset
 *
 * All processes read base, then, rate, ahead and offset from one shared page, so that they agree on
 * the time, and a jump or a standstill of the clock reaches all of them at once. Waits end when this
 * clock says so. Zenoh keeps the machine's clock: it waits on futexes, which no library sees.
 * Synced files are stamped with the wall time.
 *
 * The page also says when each process's main thread is due: at the end of its wait or, while it is
 * busy, when it left the last one. So whoever drives the clock can let it wait for a late process.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

typedef int64_t ns_t;
#define SECOND 1000000000LL
#define SHORTEST 200000LL /* pause while the clock stands still [ns] */
#define LONGEST 20000000LL

#define SLOTS 64
#define NEVER INT64_MAX

struct page {
    volatile uint64_t version; /* odd while it is being changed */
    volatile ns_t base, then, ahead, offset;
    volatile double rate;
    struct {
        volatile int64_t pid;
        volatile ns_t due;
    } slots[SLOTS];
};

static struct page *shared;
static int64_t me;
static size_t slot;

__attribute__((constructor)) static void attach(void) {
    const char *path = getenv("RIGWATCH_FAST_CLOCK");
    int file = path ? open(path, O_RDWR) : -1;
    if (file < 0) return;
    void *at = mmap(NULL, sizeof(struct page), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (at != MAP_FAILED) shared = at;
    close(file);
    /* A process that was forked and has now become this program may have waited before. */
    for (size_t i = 0; shared && i < SLOTS; i++)
        if (shared->slots[i].pid == getpid()) shared->slots[i].pid = 0;
}

static ns_t to_ns(const struct timespec *t) { return t->tv_sec * SECOND + t->tv_nsec; }
static struct timespec of_ns(ns_t t) {
    struct timespec made = {t / SECOND, t % SECOND};
    return made;
}

static ns_t machine(void) {
    static int (*next)(clockid_t, struct timespec *);
    if (!next) next = dlsym(RTLD_NEXT, "clock_gettime");
    struct timespec t;
    next(CLOCK_MONOTONIC, &t);
    return to_ns(&t);
}

/* Lets whoever changes the page finish: on a busy machine readers of the real-time class that only
 * tried again would keep it from that for as long as their class may run. */
static void let_change(void) {
    struct timespec pause = {0, 50000};
    syscall(SYS_nanosleep, &pause, NULL);
}

static ns_t fast(ns_t *offset) {
    for (;; let_change()) {
        uint64_t version = __atomic_load_n(&shared->version, __ATOMIC_ACQUIRE);
        ns_t gone = (ns_t)(shared->rate * (double)(machine() - shared->then));
        ns_t limit = shared->ahead, base = shared->base;
        *offset = shared->offset;
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (!(version & 1) && version == shared->version)
            return base + (gone < 0 ? 0 : gone > limit ? limit : gone);
    }
}

static ns_t now(int wall) {
    ns_t offset, found = fast(&offset);
    return wall ? found + offset : found;
}

static int is_wall(clockid_t id) { return id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE; }
static int is_kept(clockid_t id) {
    return is_wall(id) || id == CLOCK_MONOTONIC || id == CLOCK_MONOTONIC_RAW ||
           id == CLOCK_MONOTONIC_COARSE || id == CLOCK_BOOTTIME;
}

/* Whether a caller is the bus, whose waits cannot be seen. */
static int of_the_bus(void *caller) {
    static struct { void *at; int is; } seen[1024];
    size_t slot = ((uintptr_t)caller >> 2) & 1023;
    if (seen[slot].at != caller) {
        Dl_info info;
        int is = dladdr(caller, &info) && info.dli_fname && strstr(info.dli_fname, "zenoh") != NULL;
        seen[slot].at = NULL;
        seen[slot].is = is;
        __atomic_thread_fence(__ATOMIC_RELEASE);
        seen[slot].at = caller;
        return is;
    }
    return seen[slot].is;
}

/* The main thread of this process is due at a time; others do not count. */
static void due_at(ns_t due) {
    int64_t pid = getpid();
    if (syscall(SYS_gettid) != pid) return;
    if (me != pid) { /* the first wait, or that after a fork */
        me = pid;
        for (slot = 0; slot < SLOTS - 1; slot++) {
            int64_t none = 0;
            if (__atomic_compare_exchange_n(&shared->slots[slot].pid, &none, pid, 0,
                                            __ATOMIC_SEQ_CST, __ATOMIC_SEQ_CST))
                break;
        }
    }
    shared->slots[slot].due = due;
}
#define OWN (!shared || of_the_bus(__builtin_return_address(0)))
#define NEXT(name) \
    static __typeof__(name) *next; \
    if (!next) next = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

int clock_gettime(clockid_t id, struct timespec *t) {
    NEXT(clock_gettime);
    if (OWN || !is_kept(id)) return next(id, t);
    *t = of_ns(now(is_wall(id)));
    return 0;
}

int gettimeofday(struct timeval *restrict t, void *restrict zone) {
    NEXT(gettimeofday);
    if (OWN) return next(t, zone);
    ns_t wall = now(1);
    t->tv_sec = wall / SECOND;
    t->tv_usec = wall % SECOND / 1000;
    return 0;
}

time_t time(time_t *t) {
    NEXT(time);
    if (OWN) return next(t);
    time_t wall = now(1) / SECOND;
    if (t) *t = wall;
    return wall;
}

/* Time of the machine's clock in which `left` of this clock pass at the earliest [ns]. */
static ns_t pause_for(ns_t left) {
    double rate = shared->rate > 0.0 ? shared->rate : 1.0;
    ns_t real = (ns_t)((double)left / rate);
    return real < SHORTEST ? SHORTEST : real > LONGEST ? LONGEST : real;
}

static ns_t machine_wall(void) {
    struct timespec t;
    syscall(SYS_clock_gettime, CLOCK_REALTIME, &t);
    return to_ns(&t);
}

/* Sleeps of this clock. */
static int sleep_until(ns_t due, int wall) {
    NEXT(nanosleep);
    int failed = 0;
    due_at(now(0) + due - now(wall));
    for (ns_t left; !failed && (left = due - now(wall)) > 0;) {
        struct timespec step = of_ns(pause_for(left));
        if (next(&step, NULL) && errno == EINTR) failed = EINTR;
    }
    due_at(now(0));
    return failed;
}

int nanosleep(const struct timespec *t, struct timespec *left) {
    NEXT(nanosleep);
    if (OWN) return next(t, left);
    ns_t due = now(0) + to_ns(t);
    int failed = sleep_until(due, 0);
    if (failed && left) *left = of_ns(due - now(0) > 0 ? due - now(0) : 0);
    if (failed) errno = failed;
    return failed ? -1 : 0;
}

int clock_nanosleep(clockid_t id, int flags, const struct timespec *t, struct timespec *left) {
    NEXT(clock_nanosleep);
    if (OWN || !is_kept(id)) return next(id, flags, t, left);
    ns_t due = to_ns(t) + (flags & TIMER_ABSTIME ? 0 : now(is_wall(id)));
    return sleep_until(due, is_wall(id));
}

/* Waits: short ones of the machine's clock, until this clock says that the time is over. */
#define WAIT_LOOP(left, attempt, done) \
    due_at(now(0) + (left)); \
    for (;;) { \
        ns_t rest = (left); \
        ns_t step_ns = rest > 0 ? pause_for(rest) : 0; \
        attempt; \
        if (done || rest <= 0) break; \
    } \
    int kept_errno = errno; \
    due_at(now(0)); \
    errno = kept_errno;

/* The same without an end. */
#define ENDLESS(type, call) \
    due_at(NEVER); \
    type found = call; \
    int kept_errno = errno; \
    due_at(now(0)); \
    errno = kept_errno; \
    return found;

int poll(struct pollfd *files, nfds_t n, int timeout) {
    NEXT(poll);
    static __typeof__(ppoll) *exact;
    if (OWN || timeout == 0) return next(files, n, timeout);
    if (timeout < 0) {
        ENDLESS(int, next(files, n, timeout))
    }
    if (!exact) exact = (__typeof__(ppoll) *)dlsym(RTLD_NEXT, "ppoll");
    ns_t due = now(0) + timeout * 1000000LL;
    int found;
    struct timespec step;
    WAIT_LOOP(due - now(0), (step = of_ns(step_ns), found = exact(files, n, &step, NULL)), found)
    return found;
}

static void restore(fd_set **sets, const fd_set *kept, size_t bytes) {
    for (int i = 0; i < 3; i++)
        if (sets[i]) memcpy(sets[i], &kept[i], bytes);
}

int select(int n, fd_set *restrict in, fd_set *restrict out, fd_set *restrict other,
           struct timeval *restrict timeout) {
    NEXT(select);
    if (OWN) return next(n, in, out, other, timeout);
    if (!timeout) {
        ENDLESS(int, next(n, in, out, other, timeout))
    }
    ns_t due = now(0) + timeout->tv_sec * SECOND + timeout->tv_usec * 1000;
    size_t bytes = ((size_t)n + 63) / 64 * 8;
    fd_set kept[3];
    fd_set *sets[3] = {in, out, other};
    for (int i = 0; i < 3; i++)
        if (sets[i]) memcpy(&kept[i], sets[i], bytes);
    int found;
    struct timeval step;
    WAIT_LOOP(due - now(0),
              (restore(sets, kept, bytes), step = (struct timeval){0, step_ns / 1000},
               found = next(n, in, out, other, &step)),
              found)
    return found;
}

int epoll_wait(int file, struct epoll_event *events, int most, int timeout) {
    NEXT(epoll_wait);
    if (OWN || timeout == 0) return next(file, events, most, timeout);
    if (timeout < 0) {
        ENDLESS(int, next(file, events, most, timeout))
    }
    ns_t due = now(0) + timeout * 1000000LL;
    int found;
    WAIT_LOOP(due - now(0),
              found = next(file, events, most, (int)((step_ns + 999999) / 1000000)), found)
    return found;
}

int sem_clockwait(sem_t *restrict sem, clockid_t id, const struct timespec *restrict t) {
    NEXT(sem_clockwait);
    if (OWN || !is_kept(id)) return next(sem, id, t);
    int failed;
    struct timespec end;
    WAIT_LOOP(to_ns(t) - now(is_wall(id)),
              (end = of_ns(machine() + step_ns), failed = next(sem, CLOCK_MONOTONIC, &end)),
              !failed || errno != ETIMEDOUT)
    return failed;
}

int sem_timedwait(sem_t *restrict sem, const struct timespec *restrict t) {
    NEXT(sem_timedwait);
    if (OWN) return next(sem, t);
    int failed;
    struct timespec end;
    WAIT_LOOP(to_ns(t) - now(1), (end = of_ns(machine_wall() + step_ns), failed = next(sem, &end)),
              !failed || errno != ETIMEDOUT)
    return failed;
}

int sem_wait(sem_t *sem) {
    NEXT(sem_wait);
    if (OWN) return next(sem);
    ENDLESS(int, next(sem))
}

/* Python's interpreter lock: 5 ms, whose exact length does not matter. */
int pthread_cond_timedwait(pthread_cond_t *restrict cond, pthread_mutex_t *restrict mutex,
                           const struct timespec *restrict t) {
    NEXT(pthread_cond_timedwait);
    if (OWN) return next(cond, mutex, t);
    ns_t end = to_ns(t), fake = now(0), wall = now(1);
    int by_wall = llabs(end - wall) < llabs(end - fake);
    ns_t left = end - (by_wall ? wall : fake);
    ns_t real = (by_wall ? machine_wall() : machine()) + (left > 0 ? pause_for(left) : 0);
    struct timespec at = of_ns(real);
    return next(cond, mutex, &at);
}

static int stamp(int file, int failed) {
    struct timespec wall = of_ns(now(1)), both[2] = {wall, wall};
    if (!failed) futimens(file, both);
    return failed;
}

int fsync(int file) {
    NEXT(fsync);
    int failed = next(file);
    return OWN ? failed : stamp(file, failed);
}

int fdatasync(int file) {
    NEXT(fdatasync);
    int failed = next(file);
    return OWN ? failed : stamp(file, failed);
}
