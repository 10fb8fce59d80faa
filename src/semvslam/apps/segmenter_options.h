#pragma once

#include "semvslam/semantic/segmenter.h"

namespace CLI {
class App;
}

namespace semvslam {

/// Of single pictures. Beside a camera (SegmenterOptions::score) it is less: there a person that is missed costs more
/// than a thing taken for one, and other frames and motion see both.
inline constexpr double kLeastScoreOfStills = 0.55;

/// The options that `segment`, `eval-seg` and `eval-repair` share: --model, --threads, --backend, --precision,
/// --input-width.
void add_segmenter_options(CLI::App& parser, SegmenterOptions& options);

}  // namespace semvslam
