#include "semvslam/semantic/model_description.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "semvslam/data/file_io.h"
#include "semvslam/semantic/json_fault.h"
#include "semvslam/semantic/json_integer.h"

namespace semvslam {
namespace {

constexpr int kFormat = 1;

template <std::size_t N, typename T>
std::array<T, N> fixed(const std::vector<T>& v, const char* key) {
  if (v.size() != N) throw std::invalid_argument(fmt::format("'{}' has {} values, not {}", key, v.size(), N));
  std::array<T, N> out{};
  std::copy(v.begin(), v.end(), out.begin());
  return out;
}

void check(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(what);
}

void fill(ModelDescription& m, const nlohmann::json& j) {
  check(integer_at<int>(j, "format") == kFormat,
        "'format' is not 1: exported by another version of training/export.py");
  m.name = j.at("name").get<std::string>();
  m.trunk = j.at("trunk").get<std::string>();
  m.box = j.at("box").get<std::string>();
  m.mask = j.at("mask").get<std::string>();
  m.trunk_int8 = j.value("trunk_int8", "");
  m.refine = j.value("refine", "");
  m.input = {integer_at<int>(j.at("input"), "width"), integer_at<int>(j.at("input"), "height")};
  m.trained_width_px = m.input.width;
  m.pad = integer_at<int>(j.at("input"), "pad");
  m.classes = j.at("classes").get<std::vector<std::string>>();
  m.strides = fixed<ModelDescription::kLevels>(integers_at<int>(j, "strides"), "strides");
  m.anchor_sizes =
      fixed<ModelDescription::kLevels>(j.at("anchor_sizes").get<std::vector<std::vector<float>>>(), "anchor_sizes");
  m.anchor_ratios = j.at("anchor_ratios").get<std::vector<float>>();
  m.box_weights = fixed<4>(j.at("box_weights").get<std::vector<float>>(), "box_weights");
  m.box_levels = j.at("box_levels").get<std::vector<float>>();
  m.mask_levels = j.at("mask_levels").get<std::vector<float>>();
  m.channels = integer_at<int>(j, "feature_channels");
  m.semantic_share = j.at("semantic_share").get<float>();
  m.mask_threshold = j.at("mask_threshold").get<float>();
  if (const auto cost = j.find("gflops"); cost != j.end())
    m.gflops = {cost->at("trunk").get<double>(), cost->at("box").get<double>(), cost->at("mask").get<double>(),
                cost->value("refine", 0.)};
  check(m.input.width >= 32 && m.input.height >= 32 && m.input.width <= 4096 && m.input.height <= 4096,
        "'input' is no usable size");
  check(!m.classes.empty(), "'classes' is empty");
  check(m.semantic_share >= 0 && m.semantic_share <= 1, "'semantic_share' is not within 0 .. 1");
  check(m.mask_threshold > 0 && m.mask_threshold < 1, "'mask_threshold' is not within 0 .. 1");
  check(m.channels > 0 && m.channels <= 4096, "'feature_channels' is out of range");
  check(!m.anchor_ratios.empty() && !m.anchor_sizes[0].empty(), "no anchors");
  check(m.pad >= 0 && m.pad <= 255, "'pad' is not within 0 .. 255");
  for (const auto& sizes : m.anchor_sizes) {
    check(sizes.size() == m.anchor_sizes[0].size(), "'anchor_sizes' differ in length");
    for (const float s : sizes) check(s > 0 && s <= 4096, "'anchor_sizes' must be within 0 .. 4096 px");
  }
  for (const float r : m.anchor_ratios) check(r >= .01f && r <= 100, "'anchor_ratios' must be within 0.01 .. 100");
  for (const float w : m.box_weights) check(w >= .01f && w <= 1e4f, "'box_weights' must be within 0.01 .. 10000");
  for (const int s : m.strides)
    check(s > 0 && m.input.width % s == 0 && m.input.height % s == 0, "'input' is no multiple of 'strides'");
  if (!m.refine.empty()) {
    m.fine_stride = integer_at<int>(j, "fine_stride");
    m.fine_channels = integer_at<int>(j, "fine_channels");
    m.refine_margin = j.at("refine_margin").get<float>();
    check(m.fine_stride > 0 && m.fine_stride <= 32, "'fine_stride' is not within 1 .. 32");
    check(m.fine_channels > 0 && m.fine_channels <= 4096, "'fine_channels' is out of range");
    check(m.refine_margin >= 0 && m.refine_margin <= 1, "'refine_margin' is not within 0 .. 1");
    check(m.strides.back() % m.fine_stride == 0, "the last of 'strides' is no multiple of 'fine_stride'");
  }
  check(m.box_levels.size() < ModelDescription::kLevels && m.mask_levels.size() < ModelDescription::kLevels,
        "too many level thresholds");
}

}  // namespace

Result<ModelDescription> ModelDescription::parse(const std::string& text, const std::string& origin) {
  ModelDescription m;
  try {
    fill(m, nlohmann::json::parse(text));
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInvalidInput, fmt::format("{}: {}", origin, json_fault(e))};
  }
  return m;
}

void ModelDescription::set_input_width(int width_px) {
  const int step = strides.back();
  const auto rounded = [step](double side_px) {
    return std::max(1, static_cast<int>(std::lround(side_px / step))) * step;
  };
  const cv::Size before = input;
  input.width = rounded(width_px);
  input.height = rounded(static_cast<double>(input.width) * before.height / before.width);
  gflops.trunk *= static_cast<double>(input.area()) / before.area();
  constexpr int kSideStep = 8, kLeastSide = 24;
  const int side_before = refine_side;
  const double side = static_cast<double>(kRefineSide) * input.width / trained_width_px;
  refine_side = std::clamp(static_cast<int>(std::ceil(side / kSideStep)) * kSideStep, kLeastSide, kRefineSide);
  gflops.refine_region *= static_cast<double>(refine_side * refine_side) / (side_before * side_before);
}

Result<ModelDescription> ModelDescription::read(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "model.json";
  const Result<std::string> text = read_text_file(file);
  if (!text)
    return Error{ErrorCode::kNotFound, fmt::format("{}: cannot be opened; a model is a folder with this file and the "
                                                   "network's graphs (training/export.py writes it)",
                                                   file.string())};
  Result<ModelDescription> m = parse(*text, file.string());
  if (!m) return m;
  for (const std::string& name : {m->trunk, m->box, m->mask, m->trunk_int8, m->refine})
    if (!name.empty() && !std::filesystem::is_regular_file(folder / name))
      return Error{ErrorCode::kNotFound,
                   fmt::format("{}: names '{}', which is not in that folder", file.string(), name)};
  return m;
}

}  // namespace semvslam
