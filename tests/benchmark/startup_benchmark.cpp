// What starting each program costs, `--version`, warm: user and system time of the process, on which the goal
// of 50 ms stands. Baseline: a program of the C library alone, so that the share of fork and exec is seen.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace {

std::string Beside(const char* name) {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / name).string();
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Seconds of user and system time; below 0 where the program fails.
double RunOnce(const std::string& program) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  std::string name = program, option = "--version";
  char* arguments[] = {name.data(), option.data(), nullptr};
  pid_t child = 0;
  const int error = posix_spawn(&child, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  rusage usage = {};
  if (error != 0 || wait4(child, &status, 0, &usage) != child || status != 0) return -1;
  return Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
}

void Start(benchmark::State& state, const std::string& program) {
  double least_s = 1e9;
  for (auto _ : state) {
    const double seconds = RunOnce(program);
    if (seconds < 0) {
      state.SkipWithError((program + " does not start").c_str());
      return;
    }
    state.SetIterationTime(seconds);
    least_s = std::min(least_s, seconds);
  }
  state.counters["least_ms"] = 1000 * least_s;
}

void Starts(const std::string& name, const std::string& program) {
  benchmark::RegisterBenchmark(name.c_str(), Start, program)
      ->UseManualTime()
      ->Iterations(20)
      ->Unit(benchmark::kMillisecond);
}

}  // namespace

int main(int argc, char** argv) {
  Starts("true", "/bin/true");
  for (const char* name : {"weft", "weftd", "weft-worker"}) Starts(name, Beside(name));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
