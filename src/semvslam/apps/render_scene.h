#pragma once

#include <filesystem>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/render/scene_source.h"

namespace semvslam {

/// Renders a whole scene to a folder in TUM layout: what SequenceWriter writes, masks with the instance numbers, and
/// roles.json with their meaning. The folder appears only when it is complete. Shows progress on standard error.
/// Errors: options that break SceneOptions::check(), a folder that exists, disk full, interrupted (kIo).
Status render_to_folder(const SceneOptions& options, const std::filesystem::path& folder, bool jpeg, bool quiet);

/// Reads "640x480". @return whether it is one; whether pictures may be of that size is for SceneOptions::check().
bool parse_size(const std::string& text, int& width_px, int& height_px);

}  // namespace semvslam
