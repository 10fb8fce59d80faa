#include "semvslam/data/prefetch.h"

#include <exception>
#include <thread>

#include "semvslam/base/bounded_queue.h"

namespace semvslam {
namespace {

class PrefetchedSource final : public FrameSource {
 public:
  PrefetchedSource(std::unique_ptr<FrameSource> source, std::size_t capacity)
      : source_(std::move(source)),
        camera_(source_->camera()),
        size_(source_->size()),
        description_(source_->description()),
        queue_(capacity),
        thread_([this] { read_ahead(); }) {}

  ~PrefetchedSource() override {
    queue_.close();  // a push that waits for room returns false
    thread_.join();
  }

  Result<std::optional<RgbdFrame>> next() override {
    std::optional<Item> item = queue_.pop();
    if (!item) return std::optional<RgbdFrame>();
    fatal_ = item->fatal;
    return std::move(item->result);
  }

  bool fatal() const override { return fatal_; }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return size_; }
  std::string description() const override { return description_; }

 private:
  struct Item {
    Result<std::optional<RgbdFrame>> result;
    bool fatal = false;
  };

  Item read_one() {
    try {
      Item item{source_->next()};
      item.fatal = !item.result.ok() && source_->fatal();
      return item;
    } catch (const std::exception& e) {
      return {Error{ErrorCode::kInternal, std::string("reading a frame failed: ") + e.what()}, true};
    }
  }

  void read_ahead() {
    while (true) {
      Item item = read_one();
      const bool last = item.fatal || (item.result.ok() && !item.result->has_value());
      if (!queue_.push(std::move(item)) || last) break;
    }
    queue_.close();  // calls behind the end return the end
  }

  // The thread alone touches source_; what others ask for is copied before it starts.
  std::unique_ptr<FrameSource> source_;
  const Camera camera_;
  const std::optional<std::size_t> size_;
  const std::string description_;
  BoundedQueue<Item> queue_;
  bool fatal_ = false;
  std::thread thread_;  // last: starts when all else is there
};

}  // namespace

std::unique_ptr<FrameSource> prefetch(std::unique_ptr<FrameSource> source, std::size_t capacity) {
  return std::make_unique<PrefetchedSource>(std::move(source), capacity);
}

}  // namespace semvslam
