#include "semvslam/semantic/folder_segmenter.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string_view>

#include "semvslam/data/file_io.h"
#include "semvslam/semantic/coco_region.h"
#include "semvslam/semantic/json_fault.h"
#include "semvslam/semantic/json_integer.h"

namespace semvslam {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kLargestGapNs = 20'000'000;
constexpr std::size_t kMostJsonBytes = std::size_t{1} << 26;

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

/// The image that a file belongs to; nothing for files that hold no masks.
std::optional<std::string> image_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  if (file.extension() == ".json") return stem == "roles" ? std::nullopt : std::optional(stem);
  if (file.extension() != ".png" || stem.ends_with(".overlay")) return std::nullopt;
  constexpr std::string_view kInstances = ".instances";
  return stem.ends_with(kInstances) ? stem.substr(0, stem.size() - kInstances.size()) : stem;
}

Error wrong_file(const fs::path& file, const std::string& what) {
  return {ErrorCode::kInvalidInput, fmt::format("{}: {}", file.string(), what)};
}

std::string differs(cv::Size file, cv::Size image) {
  return fmt::format("is {}x{}, the image {}x{}", file.width, file.height, image.width, image.height);
}

}  // namespace

Result<std::unique_ptr<FolderSegmenter>> FolderSegmenter::open(const fs::path& folder, const RoleTable& roles) {
  std::error_code ec;
  if (!fs::is_directory(folder, ec))
    return Error{ErrorCode::kNotFound, fmt::format("{}: no such folder of masks", folder.string())};
  auto out = std::unique_ptr<FolderSegmenter>(new FolderSegmenter);
  out->folder_ = folder;
  out->roles_ = roles;
  for (const fs::directory_entry& e : fs::directory_iterator(folder, ec)) {
    const std::optional<std::string> image = image_of(e.path());
    if (!image) continue;
    fs::path& file = out->by_name_[*image];
    if (file.extension() != ".json") file = e.path();
    if (const auto stamp = stamp_of(*image)) out->by_stamp_[*stamp] = file;
  }
  if (out->by_name_.empty())
    return Error{ErrorCode::kNotFound, fmt::format("{}: holds no PNG or JSON file with masks", folder.string())};
  if (const Status s = out->read_roles(); !s) return s.error();
  if (out->names_.empty()) out->names_.push_back("person");
  return out;
}

Status FolderSegmenter::read_roles() {
  for (const fs::path& file : {folder_ / "roles.json", folder_.parent_path() / "roles.json"}) {
    std::ifstream stream(file);
    if (!stream) continue;
    try {
      const nlohmann::json listed = nlohmann::json::parse(stream);
      for (const nlohmann::json& role : listed)
        class_of_number_[integer_at<int>(role, "number")] = class_of(role.at("label").get<std::string>());
    } catch (const std::exception& e) {
      return wrong_file(file, json_fault(e));
    }
    break;
  }
  return Status::success();
}

int FolderSegmenter::class_of(const std::string& name) {
  auto at = std::find(names_.begin(), names_.end(), name);
  if (at == names_.end()) at = names_.insert(at, name);
  return static_cast<int>(at - names_.begin());
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
  const Status s = file->extension() == ".json" ? read_json(*file, out) : read_labels(*file, out);
  if (!s) return s.error();
  return out;
}

Status FolderSegmenter::read_labels(const fs::path& file, Segmentation& out) const {
  std::vector<std::uint8_t> bytes;
  if (Status s = read_binary_file(file, bytes); !s) return s;
  cv::Mat labels = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  if (labels.empty()) return wrong_file(file, "is no readable PNG");
  if (labels.type() != CV_8UC1 && labels.type() != CV_16UC1)
    return wrong_file(file, "a mask has one channel of 8 or 16 bits");
  if (labels.size() != out.size) return wrong_file(file, differs(labels.size(), out.size));
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
  return Status::success();
}

Status FolderSegmenter::read_json(const fs::path& file, Segmentation& out) {
  const Result<std::string> text = read_text_file(file, kMostJsonBytes);
  if (!text) return text.error();
  try {
    const nlohmann::json root = nlohmann::json::parse(*text);
    const cv::Size size(integer_at<int>(root, "width"), integer_at<int>(root, "height"));
    if (size != out.size) return wrong_file(file, differs(size, out.size));
    for (const nlohmann::json& found : root.at("instances")) {
      const cv::Mat whole = CocoRegion::parse(found.at("segmentation")).mask(size);
      const cv::Rect window = cv::boundingRect(whole);
      if (window.empty()) continue;
      Instance i;
      i.id = InstanceId(static_cast<std::uint32_t>(out.instances.size()));
      i.class_name = found.at("class").get<std::string>();
      i.class_index = class_of(i.class_name);
      i.role = roles_.role(i.class_name);
      i.score = found.value("score", 1.f);
      i.box = cv::Rect2f(window);
      i.window = window;
      i.mask = whole(window).clone();
      out.instances.push_back(std::move(i));
    }
  } catch (const std::exception& e) {
    return wrong_file(file, json_fault(e));
  }
  return Status::success();
}

std::string FolderSegmenter::description() const {
  return fmt::format("{} masks in {}", by_name_.size(), folder_.string());
}

}  // namespace semvslam
