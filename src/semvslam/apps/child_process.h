#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// How a child process ended.
struct ChildEnd {
  int exit_code = 0;
  int signal = 0;  // that killed it; 0 = none, and the exit code counts
  bool good() const { return exit_code == 0 && signal == 0; }
  /// "exit code 3", "killed by signal 11 (Segmentation fault)".
  std::string text() const;
};

/// Runs a program to its end: nothing on standard input, standard output and error to a file, our environment. Meant to
/// be called while an InterruptGuard lives: the SIGINT or SIGTERM that it catches is passed on, once, and the child is
/// then waited for all the same. The child has a process group of its own, so that a Ctrl-C on the terminal does not
/// reach it a second time. Errors: it cannot be started, the file cannot be written.
Result<ChildEnd> run_child(const std::string& program, const std::vector<std::string>& arguments,
                           const std::filesystem::path& log);

}  // namespace semvslam
