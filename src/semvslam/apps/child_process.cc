#include "semvslam/apps/child_process.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "semvslam/apps/interrupt.h"
#include "semvslam/data/file_io.h"

extern char** environ;

namespace semvslam {
namespace {

/// While it lives, SIGINT and SIGTERM reach this thread only inside ppoll() with before().
class HeldSignals {
 public:
  HeldSignals() {
    sigset_t held;
    sigemptyset(&held);
    sigaddset(&held, SIGINT);
    sigaddset(&held, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &held, &before_);
  }
  ~HeldSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;
  const sigset_t& before() const { return before_; }

 private:
  sigset_t before_{};
};

/// A pipe whose end for writing only the child holds: it is closed when the child ends, however that happens.
class LifeLine {
 public:
  LifeLine() = default;
  ~LifeLine() {
    close_end(0);
    close_end(1);
  }
  LifeLine(const LifeLine&) = delete;
  LifeLine& operator=(const LifeLine&) = delete;

  bool open() { return ::pipe2(ends_, O_CLOEXEC) == 0; }
  int childs_end() const { return ends_[1]; }
  void let_go() { close_end(1); }

  /// Waits until the child has ended. @param interrupted is called when a signal comes meanwhile
  template <typename Interrupted>
  void wait(const sigset_t& signals, const Interrupted& interrupted) {
    pollfd end{ends_[0], POLLIN, 0};
    while (::ppoll(&end, 1, nullptr, &signals) < 0 && errno == EINTR) interrupted();
  }

 private:
  void close_end(int i) {
    if (ends_[i] >= 0) ::close(std::exchange(ends_[i], -1));
  }
  int ends_[2] = {-1, -1};
};

constexpr int kLifeLineInChild = 3;  // the first descriptor behind the standard ones

/// What posix_spawn() shall do in the child before the program starts.
class SpawnPlan {
 public:
  SpawnPlan(const std::filesystem::path& log, int life_line, const sigset_t& signals) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, log.c_str(), O_WRONLY | O_APPEND, 0);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, life_line, kLifeLineInChild);
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setsigmask(&attributes_, &signals);
  }
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  /// @return 0 or the number of the error
  int start(const std::string& program, const std::vector<std::string>& arguments, pid_t* child) const {
    std::vector<char*> words = {const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    return ::posix_spawn(child, program.c_str(), &actions_, &attributes_, words.data(), environ);
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

Error cannot_start(const std::string& program, int code) {
  return {ErrorCode::kIo, fmt::format("{}: cannot be started: {}", program, std::strerror(code))};
}

ChildEnd end_of(pid_t child) {
  int state = 0;
  while (::waitpid(child, &state, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(state)) return {0, WTERMSIG(state)};
  return {WEXITSTATUS(state), 0};
}

}  // namespace

std::string ChildEnd::text() const {
  if (signal == 0) return fmt::format("exit code {}", exit_code);
  return fmt::format("killed by signal {} ({})", signal, ::strsignal(signal));
}

Result<ChildEnd> run_child(const std::string& program, const std::vector<std::string>& arguments,
                           const std::filesystem::path& log) {
  // Made here, where a failure can be told from one of the program.
  if (const Result<OutputFile> file = OutputFile::create(log); !file) return file.error();
  const HeldSignals held;
  LifeLine life_line;
  if (!life_line.open()) return cannot_start(program, errno);
  pid_t child = 0;
  const SpawnPlan plan(log, life_line.childs_end(), held.before());
  if (const int code = plan.start(program, arguments, &child); code != 0) return cannot_start(program, code);
  life_line.let_go();
  bool passed_on = false;
  const auto pass_on = [&] {
    if (passed_on || InterruptGuard::received() == 0) return;
    passed_on = true;
    ::kill(child, InterruptGuard::received());
  };
  pass_on();  // one that came before the child was there
  life_line.wait(held.before(), pass_on);
  return end_of(child);
}

}  // namespace semvslam
