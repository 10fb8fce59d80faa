#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "semvslam/data/frame.h"
#include "semvslam/dynamic/dynamic_record.h"

namespace semvslam {

/// The frame with what the policy made of it, as in the paper's Figures 8-10: what moves or may is tinted; features are
/// green (static), yellow (unknown) or red (moving), filled where a landmark was found at them; a line of text at the
/// bottom. @return CV_8UC3.
cv::Mat draw_dynamic(const RgbdFrame& frame, const DynamicRecord& record, const std::string& state);

}  // namespace semvslam
