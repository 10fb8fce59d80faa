#include "semvslam/data/tum_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

Error line_error(const std::string& name, const TextLine& line, const std::string& what) {
  return {ErrorCode::kInvalidInput, fmt::format("{}:{}: {}", name, line.number, what)};
}

/// At most 40 characters of foreign text for a message, on one line and printable.
std::string quoted(std::string_view text) {
  std::string out = "'";
  for (char c : text.substr(0, 40)) out += c >= ' ' && c <= '~' ? c : '?';
  return out + (text.size() > 40 ? "...'" : "'");
}

std::string bad_stamp(std::string_view word) {
  return fmt::format("{} is no time stamp (expected decimal seconds, e.g. 1305031102.175304)", quoted(word));
}

/// Sorts by stamp, keeps the first of equal stamps, and counts both.
template <typename T>
void sort_and_deduplicate(std::vector<T>& entries, FileList& report) {
  const auto stamp_less = [](const T& a, const T& b) { return a.stamp < b.stamp; };
  for (std::size_t i = 1; i < entries.size(); ++i) report.out_of_order += entries[i].stamp < entries[i - 1].stamp;
  if (report.out_of_order > 0) std::stable_sort(entries.begin(), entries.end(), stamp_less);
  const auto same = [](const T& a, const T& b) { return a.stamp == b.stamp; };
  const auto end = std::unique(entries.begin(), entries.end(), same);
  report.duplicates = static_cast<std::size_t>(entries.end() - end);
  entries.erase(end, entries.end());
}

void add_count(std::string& text, std::size_t count, const char* singular, const char* plural, const char* done) {
  if (count == 0) return;
  if (!text.empty()) text += ", ";
  text += fmt::format("{} {} ({})", count, count == 1 ? singular : plural, done);
}

bool mentions_depth(std::string_view file) { return file.find("depth") != std::string_view::npos; }

}  // namespace

std::string FileList::oddities() const {
  std::string text;
  add_count(text, out_of_order, "line out of order", "lines out of order", "sorted");
  add_count(text, duplicates, "duplicate time stamp", "duplicate time stamps", "first kept");
  add_count(text, non_finite, "time stamp not a number", "time stamps not a number", "dropped");
  add_count(text, cut_off, "last line broken off", "last lines broken off", "dropped");
  return text;
}

Result<FileList> parse_file_list(std::string_view text, const std::string& name) {
  FileList list;
  for (const TextLine& line : content_lines(text)) {
    const std::string_view word = split_words(line.text).front();
    std::string_view file = line.text.substr(word.size());
    while (!file.empty() && (file.front() == ' ' || file.front() == '\t')) file.remove_prefix(1);
    const std::optional<TimeStamp> stamp = parse_seconds(word);
    if (is_non_finite_word(word)) {
      ++list.non_finite;
    } else if (stamp && !file.empty()) {
      list.entries.push_back({*stamp, std::string(file)});
    } else if (!line.terminated) {
      ++list.cut_off;
    } else {
      return line_error(name, line, stamp ? "no file name after the time stamp" : bad_stamp(word));
    }
  }
  sort_and_deduplicate(list.entries, list);
  return list;
}

Result<PairList> parse_associations(std::string_view text, const std::string& name) {
  PairList list;
  std::optional<bool> depth_first;
  for (const TextLine& line : content_lines(text)) {
    const std::vector<std::string_view> words = split_words(line.text);
    if (words.size() < 4 && !line.terminated) {
      ++list.report.cut_off;
      continue;
    }
    if (words.size() != 4)
      return line_error(name, line, fmt::format("expected 'stamp file stamp file', got {} words", words.size()));
    if (!depth_first) depth_first = mentions_depth(words[1]) && !mentions_depth(words[3]);
    const int colour = *depth_first ? 2 : 0, depth = 2 - colour;
    if (is_non_finite_word(words[0]) || is_non_finite_word(words[2])) {
      ++list.report.non_finite;
      continue;
    }
    for (int i : {0, 2})
      if (!parse_seconds(words[i])) return line_error(name, line, bad_stamp(words[i]));
    list.pairs.push_back(
        {*parse_seconds(words[colour]), std::string(words[colour + 1]), std::string(words[depth + 1])});
  }
  sort_and_deduplicate(list.pairs, list.report);
  return list;
}

PairList associate(const FileList& colour, const FileList& depth, double max_gap_s) {
  struct Candidate {
    std::uint64_t gap_ns;
    std::size_t colour, depth;
  };
  const auto max_gap_ns = static_cast<std::uint64_t>(std::clamp(std::round(max_gap_s * 1e9), 0.0, 9e18));
  const auto gap = [](TimeStamp a, TimeStamp b) {  // unsigned: stamps of opposite signs may be 2^63 apart
    return a < b ? static_cast<std::uint64_t>(b.ns) - static_cast<std::uint64_t>(a.ns)
                 : static_cast<std::uint64_t>(a.ns) - static_cast<std::uint64_t>(b.ns);
  };
  std::vector<Candidate> candidates;
  std::size_t first = 0;
  for (std::size_t c = 0; c < colour.entries.size(); ++c) {
    const TimeStamp stamp = colour.entries[c].stamp;
    while (first < depth.entries.size() && depth.entries[first].stamp < stamp &&
           gap(depth.entries[first].stamp, stamp) > max_gap_ns)
      ++first;
    for (std::size_t d = first; d < depth.entries.size(); ++d) {
      const std::uint64_t g = gap(depth.entries[d].stamp, stamp);
      if (g > max_gap_ns) break;
      candidates.push_back({g, c, d});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.gap_ns < b.gap_ns; });
  constexpr std::size_t kFree = static_cast<std::size_t>(-1);
  std::vector<std::size_t> depth_of(colour.entries.size(), kFree);
  std::vector<bool> depth_used(depth.entries.size(), false);
  for (const Candidate& k : candidates) {
    if (depth_of[k.colour] != kFree || depth_used[k.depth]) continue;
    depth_of[k.colour] = k.depth;
    depth_used[k.depth] = true;
  }
  PairList list;
  for (std::size_t c = 0; c < colour.entries.size(); ++c) {
    if (depth_of[c] == kFree) continue;
    list.pairs.push_back({colour.entries[c].stamp, colour.entries[c].file, depth.entries[depth_of[c]].file});
  }
  list.colour_without_depth = colour.entries.size() - list.pairs.size();
  list.depth_without_colour = depth.entries.size() - list.pairs.size();
  return list;
}

}  // namespace semvslam
