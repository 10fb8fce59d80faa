#include "semvslam/data/tum_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

#include "semvslam/base/foreign_text.h"
#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

Error line_error(const std::string& name, const TextLine& line, const std::string& what) {
  return {ErrorCode::kInvalidInput, fmt::format("{}:{}: {}", name, line.number, what)};
}

std::string bad_stamp(std::string_view word) {
  return fmt::format("{} is no time stamp (expected decimal seconds, e.g. 1305031102.175304)", in_quotes(word));
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

constexpr std::size_t kNoPartner = static_cast<std::size_t>(-1);

/// For each colour image the depth image that the greedy rule (closest pair first, each used once) gives it, in
/// O(n log n). Along the merged time line the closest pair left is always a pair of neighbours, for anything between
/// two images of a pair would be closer to one of them: so a heap of neighbours suffices, and where a pair is taken out
/// its outer neighbours become neighbours.
std::vector<std::size_t> closest_pairs(const std::vector<TimedFile>& colour, const std::vector<TimedFile>& depth,
                                       std::uint64_t max_gap_ns) {
  struct Event {
    TimeStamp stamp;
    bool is_depth;
    std::size_t index, before, after;
  };
  std::vector<Event> line;
  for (std::size_t i = 0; i < colour.size(); ++i) line.push_back({colour[i].stamp, false, i, 0, 0});
  for (std::size_t i = 0; i < depth.size(); ++i) line.push_back({depth[i].stamp, true, i, 0, 0});
  std::stable_sort(line.begin(), line.end(), [](const Event& a, const Event& b) { return a.stamp < b.stamp; });
  using Neighbours = std::tuple<std::uint64_t, std::size_t, std::size_t>;  // gap, then places on the line
  std::priority_queue<Neighbours, std::vector<Neighbours>, std::greater<>> closest;
  const auto offer = [&](std::size_t a, std::size_t b) {
    if (a == kNoPartner || b == kNoPartner || line[a].is_depth == line[b].is_depth) return;
    // Unsigned: stamps of opposite signs may be 2^63 apart.
    const std::uint64_t gap =
        static_cast<std::uint64_t>(line[b].stamp.ns) - static_cast<std::uint64_t>(line[a].stamp.ns);
    if (gap <= max_gap_ns) closest.emplace(gap, a, b);
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    line[i].before = i == 0 ? kNoPartner : i - 1;
    line[i].after = i + 1 == line.size() ? kNoPartner : i + 1;
    if (i > 0) offer(i - 1, i);
  }
  std::vector<bool> taken(line.size(), false);
  std::vector<std::size_t> depth_of(colour.size(), kNoPartner);
  while (!closest.empty()) {
    const auto [gap, a, b] = closest.top();
    closest.pop();
    if (taken[a] || taken[b]) continue;
    taken[a] = taken[b] = true;
    depth_of[line[line[a].is_depth ? b : a].index] = line[line[a].is_depth ? a : b].index;
    const std::size_t before = line[a].before, after = line[b].after;
    if (before != kNoPartner) line[before].after = after;
    if (after != kNoPartner) line[after].before = before;
    offer(before, after);
  }
  return depth_of;
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
  const auto max_gap_ns = static_cast<std::uint64_t>(std::clamp(std::round(max_gap_s * 1e9), 0.0, 9e18));
  const std::vector<std::size_t> depth_of = closest_pairs(colour.entries, depth.entries, max_gap_ns);
  PairList list;
  for (std::size_t c = 0; c < colour.entries.size(); ++c) {
    if (depth_of[c] == kNoPartner) continue;
    list.pairs.push_back({colour.entries[c].stamp, colour.entries[c].file, depth.entries[depth_of[c]].file});
  }
  list.colour_without_depth = colour.entries.size() - list.pairs.size();
  list.depth_without_colour = depth.entries.size() - list.pairs.size();
  return list;
}

}  // namespace semvslam
