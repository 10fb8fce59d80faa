#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/slam.h"
#include "semvslam/python/arrays.h"

namespace semvslam {

/// A Slam for callers that may have many threads: process() and finish() exclude each other.
class System {
 public:
  System(const Camera& camera, const std::string& mode, const pybind11::dict& values, const pybind11::object& map,
         bool localise, bool deterministic, bool realtime)
      : camera_(camera) {
    Config config;
    raise_if(config.apply_mode(mode));
    set_values(config.schema(), values);
    config.mode = mode;
    config.mapping.frozen |= localise;
    config.deterministic |= deterministic;
    config.realtime |= realtime;
    const std::filesystem::path file = map.is_none() ? std::filesystem::path() : path_of(map);
    const pybind11::gil_scoped_release others_may_run;
    Result<std::unique_ptr<Slam>> slam = [&]() -> Result<std::unique_ptr<Slam>> {
      if (file.empty()) return Slam::create(config, camera);
      Result<Map> saved = read_map(file);
      if (!saved) return saved.error();
      return Slam::create(config, camera, std::move(*saved));
    }();
    if (!slam) {
      const pybind11::gil_scoped_acquire interpreter;
      raise(slam.error());
    }
    slam_ = std::move(*slam);
  }

  TrackResult process(const RgbdFrame& frame, const std::optional<Segmentation>& segmentation) {
    Result<TrackResult> result = [&] {
      const pybind11::gil_scoped_release others_may_run;
      const std::lock_guard lock(mutex_);
      return segmentation ? slam_->process(frame, segmentation) : slam_->process(frame);
    }();
    return value_or_raise(std::move(result));
  }
  void finish() {
    const Status status = [&] {
      const pybind11::gil_scoped_release others_may_run;
      const std::lock_guard lock(mutex_);
      return slam_->finish();
    }();
    raise_if(status);
  }
  std::optional<Segmentation> segment(const RgbdFrame& frame) {
    const pybind11::gil_scoped_release others_may_run;
    return slam_->segment(frame);
  }
  /// The queries wait for a step of mapping, which needs no interpreter.
  template <typename Query>
  auto ask(const Query& query) const {
    const pybind11::gil_scoped_release others_may_run;
    return query(*slam_);
  }
  const Camera& camera() const { return camera_; }
  Slam& slam() { return *slam_; }

 private:
  Camera camera_;
  std::unique_ptr<Slam> slam_;
  std::mutex mutex_;
};

}  // namespace semvslam
