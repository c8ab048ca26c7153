// Preloaded into any program (LD_PRELOAD), sets its clock wrong: CLOCK_REALTIME, time and gettimeofday are
// ahead by the seconds that stand in the file of WEFT_CLOCK_FILE, which is read again at each call, so that
// the clock jumps while the program runs. Clocks that count from the start of the machine go on as they are,
// and so do the times of files.
#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>

#include <cstdio>
#include <cstdlib>

namespace {

long long Ahead_s() {
  const char* path = std::getenv("WEFT_CLOCK_FILE");
  std::FILE* file = path != nullptr ? std::fopen(path, "re") : nullptr;
  if (file == nullptr) return 0;
  long long ahead_s = 0;
  if (std::fscanf(file, "%lld", &ahead_s) != 1) ahead_s = 0;
  std::fclose(file);
  return ahead_s;
}

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  static auto* const next = Next<int(clockid_t, timespec*)>("clock_gettime");
  const int result = next(clock, now);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) now->tv_sec += Ahead_s();
  return result;
}

int gettimeofday(timeval* now, void* zone) noexcept {
  static auto* const next = Next<int(timeval*, void*)>("gettimeofday");
  const int result = next(now, zone);
  if (result == 0) now->tv_sec += Ahead_s();
  return result;
}

time_t time(time_t* when) noexcept {
  timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (when != nullptr) *when = now.tv_sec;
  return now.tv_sec;
}
}
