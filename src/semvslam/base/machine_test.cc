#include "semvslam/base/machine.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

TEST(Machine, IsTheOneThatRunsThis) {
  const Machine machine = this_machine();
  EXPECT_GE(machine.usable_cores, 1);
  EXPECT_GT(machine.memory_bytes, std::int64_t{64} << 20);
  EXPECT_GE(machine.load, 0);
  EXPECT_NE(machine.compiler.find('.'), std::string::npos) << machine.compiler;
}

}  // namespace
}  // namespace semvslam
