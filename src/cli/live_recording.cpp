#include "live_recording.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

// Its exit code, or -1. An interrupt ends the listening, not what comes of it.
int RunAndWait(const fs::path& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  posix_spawnattr_t attributes;
  sigset_t interrupts;
  sigemptyset(&interrupts);
  sigaddset(&interrupts, SIGINT);
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigdefault(&attributes, &interrupts);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const auto interrupt = std::signal(SIGINT, SIG_IGN);
  pid_t child = 0;
  const bool started = posix_spawn(&child, program.c_str(), nullptr, &attributes, pointers.data(), environ) == 0;
  posix_spawnattr_destroy(&attributes);
  int status = 0;
  const bool ended = started && waitpid(child, &status, 0) == child && WIFEXITED(status);
  std::signal(SIGINT, interrupt);
  return ended ? WEXITSTATUS(status) : -1;
}

}  // namespace

Expected<std::optional<LiveRecording>> LiveRecording::Listen(double seconds) {
  std::error_code failed;
  const fs::path recorder = fs::read_symlink("/proc/self/exe", failed).parent_path() / "topic_recorder";
  if (failed || !fs::exists(recorder, failed)) {
    return Error{fmt::format("--live: {} is not there; expected a build with ROS", recorder.string())};
  }
  std::string pattern = (fs::temp_directory_path() / "planar_vslam_live_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) {
    return Error{fmt::format("{}: no folder can be made in it; expected one to record into (TMPDIR)",
                             fs::temp_directory_path().string())};
  }
  LiveRecording recording{fs::path(pattern)};
  const int code = RunAndWait(recorder, {recording.bag().string(), fmt::format("{}", seconds)});
  if (code == kExitBadInput) return std::optional<LiveRecording>();  // it has said why
  if (code != kExitSuccess) return Error{fmt::format("--live: {} failed; nothing was recorded", recorder.string())};
  return std::optional<LiveRecording>(std::move(recording));
}

LiveRecording::~LiveRecording() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

}  // namespace planar_vslam
