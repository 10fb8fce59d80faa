#include "semvslam/pipeline/saved_map.h"

#include <fmt/format.h>

#include <string>

namespace semvslam {
namespace {

constexpr double kCameraTolerancePx = 1;

std::string describe(const Camera& c) {
  return fmt::format("{}x{}, fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f}", c.width_px, c.height_px, c.fx_px, c.fy_px,
                     c.cx_px, c.cy_px);
}

bool same_levels(const ObservationModel& a, const ObservationModel& b) {
  if (a.levels() != b.levels()) return false;
  for (int level = 0; level < a.levels(); ++level)
    if (a.level_scale(level) != b.level_scale(level)) return false;
  return true;
}

}  // namespace

Status check_saved_map(const Map& map, const ObservationModel& model) {
  const auto unfit = [](const std::string& what) { return Error{ErrorCode::kInvalidInput, "saved map: " + what}; };
  if (map.key_frames().empty()) return unfit("it has no key frames, nothing can be found in it");
  const Camera &ours = model.camera(), &its = map.model().camera();
  if (ours.width_px != its.width_px || ours.height_px != its.height_px)
    return unfit(fmt::format("its camera ({}) is not the recording's ({})", describe(its), describe(ours)));
  if (const double shift_px = ours.largest_shift_px(its); !(shift_px <= kCameraTolerancePx))
    return unfit(
        fmt::format("its camera ({}) is not the recording's ({}): pixels, lens included, are up to {:.1f} apart",
                    describe(its), describe(ours), shift_px));
  if (!same_levels(map.model(), model))
    return unfit(
        fmt::format("it was made with other orb.levels or orb.scale_factor ({} levels, the last of scale "
                    "{:.2f}): set the same ones",
                    map.model().levels(), map.model().level_scale(map.model().levels() - 1)));
  return Status::success();
}

}  // namespace semvslam
