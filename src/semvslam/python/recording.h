#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "semvslam/data/sequence.h"
#include "semvslam/python/arrays.h"

namespace semvslam {

/// A recording that is read frame by frame.
class Recording {
 public:
  Recording(std::filesystem::path folder, const SequenceOptions& options, bool must_be_whole)
      : folder_(std::move(folder)),
        source_(value_or_raise(open_sequence(folder_, options))),
        must_be_whole_(must_be_whole) {}

  /// Raises StopIteration at the end, and ValueError once it was lent.
  RgbdFrame next() {
    if (lent_) throw pybind11::value_error("this sequence is being read ahead: iterate over what ahead() gave");
    std::optional<RgbdFrame> frame;
    Status failed;
    {
      const pybind11::gil_scoped_release others_may_run;
      Result<std::optional<RgbdFrame>> read = must_be_whole_ ? source_->next() : next_readable(*source_);
      if (read)
        frame = std::move(*read);
      else
        failed = read.error();
    }
    raise_if(failed);
    if (!frame) throw pybind11::stop_iteration();
    return *std::move(frame);
  }
  const std::filesystem::path& folder() const { return folder_; }
  const FrameSource& source() const { return *source_; }
  /// For somebody else to read, from where it is; once.
  FrameSource& lend() {
    if (lent_) throw pybind11::value_error("this sequence is being read ahead already");
    lent_ = true;
    return *source_;
  }
  bool must_be_whole() const { return must_be_whole_; }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<FrameSource> source_;
  bool must_be_whole_, lent_ = false;
};

}  // namespace semvslam
