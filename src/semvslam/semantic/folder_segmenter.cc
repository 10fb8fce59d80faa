#include "semvslam/semantic/folder_segmenter.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kLargestGapNs = 20'000'000;

/// Seconds with nine digits behind the point at most, exactly; 0 for anything else.
std::optional<TimeStamp> stamp_of(const std::string& stem) {
  const std::size_t point = stem.find('.');
  const std::string whole = stem.substr(0, point), part = point == std::string::npos ? "" : stem.substr(point + 1);
  const auto digits = [](const std::string& s) {
    return std::all_of(s.begin(), s.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  if (whole.empty() || whole.size() > 10 || part.size() > 9 || !digits(whole) || !digits(part)) return std::nullopt;
  std::int64_t ns = std::atoll(whole.c_str()) * 1'000'000'000;
  if (!part.empty()) ns += std::atoll((part + std::string(9 - part.size(), '0')).c_str());
  return TimeStamp{ns};
}

}  // namespace

Result<std::unique_ptr<Segmenter>> FolderSegmenter::open(const fs::path& folder, const RoleTable& roles) {
  std::error_code ec;
  if (!fs::is_directory(folder, ec))
    return Error{ErrorCode::kNotFound, fmt::format("{}: no such folder of masks", folder.string())};
  auto out = std::unique_ptr<FolderSegmenter>(new FolderSegmenter);
  out->folder_ = folder;
  out->roles_ = roles;
  for (const fs::directory_entry& e : fs::directory_iterator(folder, ec)) {
    if (e.path().extension() != ".png") continue;
    const std::string stem = e.path().stem().string();
    out->by_name_[stem] = e.path();
    if (const auto stamp = stamp_of(stem)) out->by_stamp_[*stamp] = e.path();
  }
  if (out->by_name_.empty()) return Error{ErrorCode::kNotFound, fmt::format("{}: holds no PNG file", folder.string())};

  for (const fs::path& file : {folder / "roles.json", folder.parent_path() / "roles.json"}) {
    std::ifstream stream(file);
    if (!stream) continue;
    try {
      const nlohmann::json listed = nlohmann::json::parse(stream);
      for (const nlohmann::json& role : listed) {
        const auto label = role.at("label").get<std::string>();
        auto at = std::find(out->names_.begin(), out->names_.end(), label);
        if (at == out->names_.end()) at = out->names_.insert(at, label);
        out->class_of_number_[role.at("number").get<int>()] = static_cast<int>(at - out->names_.begin());
      }
    } catch (const nlohmann::json::exception& e) {
      return Error{ErrorCode::kInvalidInput, fmt::format("{}: {}", file.string(), e.what())};
    }
    break;
  }
  if (out->names_.empty()) out->names_.push_back("person");
  return std::unique_ptr<Segmenter>(std::move(out));
}

const fs::path* FolderSegmenter::find(const SegmentationRequest& request) const {
  if (const auto it = by_name_.find(fs::path(request.name).stem().string());
      !request.name.empty() && it != by_name_.end())
    return &it->second;
  const fs::path* best = nullptr;
  std::int64_t gap = kLargestGapNs + 1;
  const auto consider = [&](auto it) {
    if (const std::int64_t d = std::abs(it->first.ns - request.stamp.ns); d < gap) {
      gap = d;
      best = &it->second;
    }
  };
  const auto after = by_stamp_.lower_bound(request.stamp);
  if (after != by_stamp_.end()) consider(after);
  if (after != by_stamp_.begin()) consider(std::prev(after));
  return best;
}

Result<Segmentation> FolderSegmenter::segment(const SegmentationRequest& request) {
  if (request.image.empty()) return Error{ErrorCode::kInvalidInput, "the image to segment is empty"};
  Segmentation out{request.frame, request.stamp, request.image.size(), {}};
  const fs::path* file = find(request);
  if (!file) return out;
  cv::Mat labels = cv::imread(file->string(), cv::IMREAD_UNCHANGED);
  const auto wrong = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidInput, fmt::format("{}: {}", file->string(), what)};
  };
  if (labels.empty()) return wrong("is no readable PNG");
  if (labels.type() != CV_8UC1 && labels.type() != CV_16UC1) return wrong("a mask has one channel of 8 or 16 bits");
  if (labels.size() != request.image.size())
    return wrong(
        fmt::format("is {}x{}, the image {}x{}", labels.cols, labels.rows, request.image.cols, request.image.rows));
  labels.convertTo(labels, CV_16U);

  std::map<int, cv::Rect> windows;
  for (int y = 0; y < labels.rows; ++y) {
    const std::uint16_t* row = labels.ptr<std::uint16_t>(y);
    for (int x = 0; x < labels.cols;) {
      const int value = row[x], start = x;
      while (x < labels.cols && row[x] == value) ++x;
      if (value == 0) continue;
      const cv::Rect run(start, y, x - start, 1);
      cv::Rect& window = windows[value];
      window = window.empty() ? run : window | run;
    }
  }
  for (const auto& [number, window] : windows) {
    Instance i;
    i.id = InstanceId(static_cast<std::uint32_t>(out.instances.size()));
    const auto named = class_of_number_.find(number);
    i.class_index = named == class_of_number_.end() ? 0 : named->second;
    i.class_name = named == class_of_number_.end() && !class_of_number_.empty()
                       ? "unknown"
                       : names_[static_cast<std::size_t>(i.class_index)];
    i.role = roles_.role(i.class_name);
    i.score = 1.f;
    i.box = cv::Rect2f(window);
    i.window = window;
    i.mask = labels(window) == number;
    out.instances.push_back(std::move(i));
  }
  return out;
}

std::string FolderSegmenter::description() const {
  return fmt::format("{} masks in {}", by_name_.size(), folder_.string());
}

}  // namespace semvslam
