#include "semvslam/data/prefetch.h"

#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <stdexcept>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

/// Counts through `script`: 'f' a frame, 'e' an error, 'F' a fatal error, 'x' an exception; then the end.
class ScriptedSource final : public FrameSource {
 public:
  ScriptedSource(std::string script, std::atomic<int>* calls) : script_(std::move(script)), calls_(calls) {
    camera_.fx_px = 123;
  }
  Result<std::optional<RgbdFrame>> next() override {
    const std::size_t i = index_++;
    ++*calls_;
    if (i >= script_.size()) return std::optional<RgbdFrame>();
    if (script_[i] == 'x') throw std::runtime_error("out of ideas");
    fatal_ = script_[i] == 'F';
    if (script_[i] != 'f') return Error{ErrorCode::kIo, "error " + std::to_string(i)};
    RgbdFrame frame;
    frame.id = FrameId(static_cast<std::uint32_t>(i));
    frame.gray = cv::Mat(4, 4, CV_8UC1, cv::Scalar(static_cast<double>(i)));
    return std::optional<RgbdFrame>(std::move(frame));
  }
  bool fatal() const override { return fatal_; }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return script_.size(); }
  std::string description() const override { return "script"; }

 private:
  std::string script_;
  std::atomic<int>* calls_;
  Camera camera_;
  std::size_t index_ = 0;
  bool fatal_ = false;
};

/// What comes, in the letters of the script, '.' for the end.
std::string take(FrameSource& source) {
  const auto result = source.next();
  if (!result) return source.fatal() ? "F" : "e";
  return result->has_value() ? "f" : ".";
}

class PrefetchTest : public ::testing::Test {
 protected:
  std::unique_ptr<FrameSource> make(std::string script, std::size_t capacity) {
    return prefetch(std::make_unique<ScriptedSource>(std::move(script), &calls_), capacity);
  }
  std::atomic<int> calls_{0};
};

TEST_F(PrefetchTest, GivesFramesAndErrorsInOrderAndStaysAtTheEnd) {
  for (std::size_t capacity : {0, 1, 3, 100}) {
    auto source = make("ffeffe", capacity);
    std::string seen;
    for (int i = 0; i < 8; ++i) seen += take(*source);
    EXPECT_EQ(seen, "ffeffe..") << capacity;
    EXPECT_FALSE(source->fatal());
  }
}

TEST_F(PrefetchTest, FramesKeepTheirContent) {
  auto source = make(std::string(200, 'f'), 4);
  for (std::uint32_t i = 0; i < 200; ++i) {
    const auto result = source->next();
    ASSERT_TRUE(result.ok() && result->has_value());
    EXPECT_EQ((*result)->id, FrameId(i));
    EXPECT_EQ((*result)->gray.at<std::uint8_t>(3, 3), i);
  }
}

TEST_F(PrefetchTest, AFatalErrorIsTheLastThing) {
  auto source = make("feFff", 2);
  std::string seen;
  for (int i = 0; i < 5; ++i) seen += take(*source);
  EXPECT_EQ(seen, "feF..");
}

TEST_F(PrefetchTest, AnExceptionBecomesAFatalError) {
  auto source = make("fx", 2);
  EXPECT_EQ(take(*source), "f");
  const auto result = source->next();
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error().message, HasSubstr("out of ideas"));
  EXPECT_TRUE(source->fatal());
  EXPECT_EQ(take(*source), ".");
}

TEST_F(PrefetchTest, PassesOnWhatIsKnownOfTheSource) {
  auto source = make("fff", 2);
  EXPECT_EQ(source->camera().fx_px, 123);
  EXPECT_EQ(source->size(), 3u);
  EXPECT_EQ(source->description(), "script");
}

TEST_F(PrefetchTest, ReadsNoFurtherAheadThanItsCapacity) {
  auto source = make(std::string(100, 'f'), 5);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(take(*source), "f");
  // 10 taken, 5 in the queue, one in the thread's hand, perhaps one more being taken out.
  EXPECT_LE(calls_.load(), 17);
}

TEST_F(PrefetchTest, CanBeDestroyedAtAnyTime) {
  for (int taken : {0, 1, 7, 20}) {
    for (std::size_t capacity : {1, 4, 50}) {
      auto source = make(std::string(20, 'f'), capacity);
      for (int i = 0; i < taken; ++i) take(*source);
      source.reset();
    }
  }
  EXPECT_LE(calls_.load(), 4 * 3 * 21);
}

TEST_F(PrefetchTest, MayBeReadByAnotherThreadThanTheMakers) {
  auto source = make("fff", 2);
  auto reader = std::async(std::launch::async, [&] {
    std::string seen;
    for (int i = 0; i < 4; ++i) seen += take(*source);
    return seen;
  });
  EXPECT_EQ(reader.get(), "fff.");
}

}  // namespace
}  // namespace semvslam
