// Preloaded into a run, it makes the clocks that stages are timed with (the steady clock, and Ceres' time of day) stand
// still while other programs have the core: times of images and stages become CPU times of the thread, on a machine
// with other work and for executables that know nothing of it. For runs on one thread, where nobody waits by a clock.
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <ctime>

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  return static_cast<int>(syscall(SYS_clock_gettime, clock == CLOCK_MONOTONIC ? CLOCK_THREAD_CPUTIME_ID : clock, time));
}

extern "C" int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  timespec spent{};
  const int failed = clock_gettime(CLOCK_MONOTONIC, &spent);
  time->tv_sec = spent.tv_sec;
  time->tv_usec = spent.tv_nsec / 1000;
  return failed;
}
