#include "semvslam/data/sequence_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "semvslam/data/file_io.h"
#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;

Error invalid(const fs::path& where, const std::string& what) {
  return {ErrorCode::kInvalidInput, where.string() + ": " + what};
}

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}
bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool is_image_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  static constexpr const char* kExtensions[] = {".png", ".jpg", ".jpeg", ".bmp", ".pgm",
                                                ".ppm", ".tif", ".tiff", ".webp"};
  return std::find(std::begin(kExtensions), std::end(kExtensions), extension) != std::end(kExtensions);
}

/// The last run of digits in a text: "frame-000017.color" -> 17. Nothing without digits or beyond 18 of them.
std::optional<std::int64_t> last_number(const std::string& text) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t end = text.size();
  while (end > 0 && !digit(text[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && digit(text[begin - 1])) --begin;
  if (begin == end || end - begin > 18) return std::nullopt;
  return std::stoll(text.substr(begin, end - begin));
}

/// The time that a file name tells, where it tells one (see detect_layout).
std::optional<TimeStamp> stamp_in_name(const std::string& stem) {
  const bool digits_only = !stem.empty() && stem.find_first_not_of("0123456789") == std::string::npos;
  if (digits_only) {
    for (const auto& [digits, divisor] : {std::pair{13, "e-3"}, std::pair{16, "e-6"}, std::pair{19, "e-9"}})
      if (static_cast<int>(stem.size()) == digits) return parse_seconds(stem + divisor);
    return std::nullopt;
  }
  if (stem.find('.') == std::string::npos || stem.find_first_not_of("0123456789.") != std::string::npos)
    return std::nullopt;
  return parse_seconds(stem);
}

/// The images of a folder in natural order: by their last number, then by name ("2.png" before "10.png").
Result<std::vector<std::string>> image_names(const fs::path& folder) {
  std::vector<std::pair<std::int64_t, std::string>> keyed;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (is_image_name(it->path()))
      keyed.emplace_back(last_number(it->path().stem().string()).value_or(-1), it->path().filename().string());
  if (error) return Error{ErrorCode::kIo, folder.string() + ": cannot list: " + error.message()};
  std::sort(keyed.begin(), keyed.end());
  std::vector<std::string> names;
  for (auto& [number, name] : keyed) names.push_back(std::move(name));
  return names;
}

std::string stem_of(const std::string& name) { return fs::path(name).stem().string(); }

/// Both folders' names as lists of times, or nothing when a name tells none.
std::optional<FileList> timed_names(const std::string& folder, const std::vector<std::string>& names) {
  FileList list;
  for (const std::string& name : names) {
    const std::optional<TimeStamp> stamp = stamp_in_name(stem_of(name));
    if (!stamp) return std::nullopt;
    list.entries.push_back({*stamp, folder + "/" + name});
  }
  std::sort(list.entries.begin(), list.entries.end(), [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  return list;
}

/// Pairs colour and depth names whose `key` is equal; the colour names' order stays.
template <typename KeyOf>
PairList pair_by_key(const std::string& colour_folder, const std::vector<std::string>& colour,
                     const std::string& depth_folder, const std::vector<std::string>& depth, KeyOf key_of) {
  std::map<decltype(key_of(std::string())), std::string> depth_of;
  for (const std::string& name : depth) depth_of.emplace(key_of(name), name);
  PairList list;
  for (const std::string& name : colour) {
    const auto found = depth_of.find(key_of(name));
    if (found == depth_of.end()) continue;
    list.pairs.push_back({{}, colour_folder + "/" + name, depth_folder + "/" + found->second});
    depth_of.erase(found);
  }
  list.colour_without_depth = colour.size() - list.pairs.size();
  list.depth_without_colour = depth.size() - list.pairs.size();
  return list;
}

/// Frame numbers from the names where every name has one and they grow, else 0, 1, 2...
void number_pairs(std::vector<ImagePair>& pairs) {
  std::vector<std::int64_t> numbers;
  for (const ImagePair& pair : pairs) {
    const std::optional<std::int64_t> n = last_number(stem_of(pair.colour_file));
    if (!n || *n > 1000000000 || (!numbers.empty() && *n <= numbers.back())) break;
    numbers.push_back(*n);
  }
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].stamp.ns = (numbers.size() == pairs.size() ? numbers[i] : static_cast<std::int64_t>(i)) * 1000000000;
}

Result<SequenceLayout> layout_of_folders(const fs::path& folder, const std::string& colour_folder, double max_gap_s) {
  const std::string depth_folder = "depth";
  const Result<std::vector<std::string>> colour = image_names(folder / colour_folder);
  if (!colour) return colour.error();
  const Result<std::vector<std::string>> depth = image_names(folder / depth_folder);
  if (!depth) return depth.error();
  SequenceLayout layout;
  layout.kind = SequenceKind::kImageFolders;
  const std::optional<FileList> colour_times = timed_names(colour_folder, *colour);
  const std::optional<FileList> depth_times = timed_names(depth_folder, *depth);
  if (colour_times && depth_times) {
    layout.pairs = associate(*colour_times, *depth_times, max_gap_s);
    return layout;
  }
  layout.stamps_are_frame_numbers = true;
  layout.pairs = pair_by_key(colour_folder, *colour, depth_folder, *depth, stem_of);
  const auto numbered = [](const std::string& name) { return last_number(stem_of(name)).has_value(); };
  if (layout.pairs.pairs.empty() && std::all_of(colour->begin(), colour->end(), numbered) &&
      std::all_of(depth->begin(), depth->end(), numbered))
    layout.pairs = pair_by_key(colour_folder, *colour, depth_folder, *depth,
                               [](const std::string& name) { return *last_number(stem_of(name)); });
  if (layout.pairs.pairs.empty() && colour->size() == depth->size()) {
    layout.pairs = {};
    for (std::size_t i = 0; i < colour->size(); ++i)
      layout.pairs.pairs.push_back({{}, colour_folder + "/" + (*colour)[i], depth_folder + "/" + (*depth)[i]});
    layout.warnings.push_back("colour and depth images have different names; paired by their order");
  }
  number_pairs(layout.pairs.pairs);
  return layout;
}

Result<FileList> read_list(const fs::path& path, SequenceLayout& layout) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.error();
  Result<FileList> list = parse_file_list(*text, path.string());
  if (!list) return list.error();
  const std::string odd = list->oddities();
  if (list->entries.empty()) return invalid(path, "no image in the list" + (odd.empty() ? "" : ": " + odd));
  if (!odd.empty()) layout.warnings.push_back(path.filename().string() + ": " + odd);
  return list;
}

Result<SequenceLayout> layout_of_lists(const fs::path& folder, double max_gap_s) {
  SequenceLayout layout;
  layout.kind = SequenceKind::kTimedLists;
  const Result<FileList> colour = read_list(folder / "rgb.txt", layout);
  if (!colour) return colour.error();
  const Result<FileList> depth = read_list(folder / "depth.txt", layout);
  if (!depth) return depth.error();
  layout.pairs = associate(*colour, *depth, max_gap_s);
  if (layout.pairs.pairs.empty())
    return invalid(
        folder, fmt::format("none of {} colour images has a depth image within {} s (rgb.txt {}..{}, depth.txt "
                            "{}..{}): different clocks?",
                            colour->entries.size(), max_gap_s, format_seconds(colour->entries.front().stamp),
                            format_seconds(colour->entries.back().stamp), format_seconds(depth->entries.front().stamp),
                            format_seconds(depth->entries.back().stamp)));
  return layout;
}

/// ICL-NUIM: stamps are the numbers of the frames.
bool has_frame_numbers(const std::vector<ImagePair>& pairs) {
  return std::all_of(pairs.begin(), pairs.end(), [](const ImagePair& pair) {
    if (pair.stamp.ns < 0 || pair.stamp.ns % 1000000000 != 0) return false;
    const std::int64_t number = pair.stamp.ns / 1000000000;
    return stem_of(pair.colour_file) == std::to_string(number) && stem_of(pair.depth_file) == std::to_string(number);
  });
}

Result<SequenceLayout> layout_of_associations(const fs::path& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.error();
  Result<PairList> pairs = parse_associations(*text, path.string());
  if (!pairs) return pairs.error();
  if (pairs->pairs.empty()) return invalid(path, "no pair of images in the list");
  SequenceLayout layout;
  layout.stamps_are_frame_numbers = has_frame_numbers(pairs->pairs);
  layout.kind = layout.stamps_are_frame_numbers ? SequenceKind::kIclNuim : SequenceKind::kAssociations;
  if (const std::string odd = pairs->report.oddities(); !odd.empty())
    layout.warnings.push_back(path.filename().string() + ": " + odd);
  layout.pairs = std::move(*pairs);
  return layout;
}

}  // namespace

std::string SequenceLayout::kind_name() const {
  switch (kind) {
    case SequenceKind::kTimedLists:
      return "TUM lists";
    case SequenceKind::kAssociations:
      return "associations";
    case SequenceKind::kIclNuim:
      return "ICL-NUIM";
    case SequenceKind::kImageFolders:
      return "image folders";
  }
  return "";
}

Result<SequenceLayout> detect_layout(const fs::path& folder, double max_gap_s) {
  std::error_code error;
  if (!fs::exists(folder, error)) return Error{ErrorCode::kNotFound, folder.string() + ": no such folder"};
  if (!is_folder(folder)) return invalid(folder, "is not a folder (a sequence is a folder of images)");
  if (is_file(folder / "rgb.txt") && is_file(folder / "depth.txt")) return layout_of_lists(folder, max_gap_s);
  for (const char* name : {"associations.txt", "association.txt", "associate.txt"})
    if (is_file(folder / name)) return layout_of_associations(folder / name);
  for (const char* colour : {"rgb", "color", "colour", "image", "images"}) {
    if (!is_folder(folder / colour) || !is_folder(folder / "depth")) continue;
    Result<SequenceLayout> layout = layout_of_folders(folder, colour, max_gap_s);
    if (layout && layout->pairs.pairs.empty())
      return invalid(folder,
                     fmt::format("no image of {}/ ({} there) belongs to one of depth/ ({} there), neither by name, "
                                 "number nor time",
                                 colour, layout->pairs.colour_without_depth, layout->pairs.depth_without_colour));
    return layout;
  }
  return invalid(
      folder,
      "no RGB-D sequence here (looked for rgb.txt + depth.txt, associations.txt, rgb/ or color/ beside depth/)");
}

void scale_stamps(SequenceLayout& layout, double frame_rate_hz) {
  if (!layout.stamps_are_frame_numbers) return;
  for (ImagePair& pair : layout.pairs.pairs)
    pair.stamp.ns = std::llround(static_cast<long double>(pair.stamp.ns) / frame_rate_hz);
  layout.stamps_are_frame_numbers = false;
}

}  // namespace semvslam
