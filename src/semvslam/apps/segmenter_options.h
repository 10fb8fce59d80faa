#pragma once

#include "semvslam/semantic/segmenter.h"

namespace CLI {
class App;
}

namespace semvslam {

/// The options that `segment`, `eval-seg` and `eval-repair` share: --model, --threads, --backend, --precision,
/// --input-width.
void add_segmenter_options(CLI::App& parser, SegmenterOptions& options);

}  // namespace semvslam
