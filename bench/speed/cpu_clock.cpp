// Preloaded into a run, it makes the steady clock stand still while other programs have the core: times of images and
// stages become CPU times of the thread, on a machine with other work and for executables that know nothing of it. For
// runs on one thread, where nobody waits by that clock.
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  return static_cast<int>(syscall(SYS_clock_gettime, clock == CLOCK_MONOTONIC ? CLOCK_THREAD_CPUTIME_ID : clock, time));
}
