#include "semvslam/apps/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "semvslam/apps/interrupt.h"
#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using testing_support::TemporaryFolder;

Result<ChildEnd> shell(const std::string& script, const std::filesystem::path& log) {
  return run_child("/bin/sh", {"-c", script}, log);
}

TEST(RunChild, TellsTheExitCodeAndKeepsWhatWasPrinted) {
  const TemporaryFolder folder;
  const auto end = shell("echo out; echo err >&2; exit 3", folder / "log");
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(end->exit_code, 3);
  EXPECT_FALSE(end->good());
  EXPECT_EQ(end->text(), "exit code 3");
  EXPECT_EQ(*read_text_file(folder / "log"), "out\nerr\n");
  EXPECT_TRUE(shell("exit 0", folder / "log")->good());
  EXPECT_EQ(*read_text_file(folder / "log"), "") << "every child starts it anew";
}

TEST(RunChild, TellsTheSignalThatKilledIt) {
  const TemporaryFolder folder;
  const auto end = shell("kill -SEGV $$", folder / "log");
  ASSERT_TRUE(end);
  EXPECT_EQ(end->signal, SIGSEGV);
  EXPECT_FALSE(end->good());
  EXPECT_THAT(end->text(), HasSubstr("killed by signal 11"));
}

TEST(RunChild, WhatCannotStartIsAnError) {
  const TemporaryFolder folder;
  const auto missing = run_child(folder / "no_program", {}, folder / "log");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("cannot be started"));
  const auto unwritable = run_child("/bin/sh", {"-c", "exit 0"}, folder / "no" / "log");
  ASSERT_FALSE(unwritable);
  EXPECT_THAT(unwritable.error().message, HasSubstr("cannot write"));
}

TEST(RunChild, StandardInputIsEmpty) {
  const TemporaryFolder folder;
  EXPECT_TRUE(shell("read x; test -z \"$x\"", folder / "log")->good());
}

/// The signal is sent by the child itself, when its handler stands: there is nothing to wait for.
TEST(RunChild, PassesASignalOnOnce) {
  const TemporaryFolder folder;
  const InterruptGuard guard;
  const auto end = shell(
      "n=0; trap 'n=$((n+1))' TERM; kill -TERM $PPID; while [ $n -eq 0 ]; do sleep 0.05; done; echo got; "
      "sleep 0.2; exit $((10 + n))",
      folder / "log");
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(InterruptGuard::received(), SIGTERM);
  EXPECT_EQ(end->exit_code, 11);
  EXPECT_EQ(*read_text_file(folder / "log"), "got\n");
}

TEST(RunChild, ASignalThatCameBeforeReachesTheChildToo) {
  const TemporaryFolder folder;
  const InterruptGuard guard;
  std::raise(SIGINT);
  const auto end = shell("sleep 60", folder / "log");
  ASSERT_TRUE(end);
  EXPECT_EQ(end->signal, SIGINT);
}

TEST(RunChild, LeavesTheSignalMaskAsItWas) {
  const TemporaryFolder folder;
  sigset_t before, after;
  pthread_sigmask(SIG_BLOCK, nullptr, &before);
  ASSERT_TRUE(shell("exit 0", folder / "log"));
  pthread_sigmask(SIG_BLOCK, nullptr, &after);
  EXPECT_EQ(sigismember(&before, SIGINT), sigismember(&after, SIGINT));
  EXPECT_EQ(sigismember(&after, SIGTERM), 0);
}

}  // namespace
}  // namespace semvslam
