#include "semvslam/place/place_index.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "semvslam/base/random.h"

namespace semvslam {

PlaceIndex::PlaceIndex() : postings_(kTables << kBits) {
  std::vector<std::uint8_t> bits(256);
  std::iota(bits.begin(), bits.end(), std::uint8_t{0});
  Random(1, "place.words").shuffle(bits);
  // No bit is in two tables: corners that one table misses for an unstable bit have a chance in the others.
  for (std::size_t t = 0; t < kTables; ++t)
    std::copy_n(bits.begin() + static_cast<std::ptrdiff_t>(t * kBits), kBits, bits_[t].begin());
}

void PlaceIndex::words_of(const Descriptor& descriptor, std::array<Word, kTables>& out) const {
  for (std::size_t t = 0; t < kTables; ++t) {
    Word word = static_cast<Word>(t);
    for (const std::uint8_t bit : bits_[t]) word = word << 1 | ((descriptor[bit / 64] >> (bit % 64)) & 1);
    out[t] = word;
  }
}

void PlaceIndex::add(KeyFrameId id, std::span<const Descriptor> descriptors) {
  remove(id);
  std::vector<Word>& words = words_of_[id];
  std::array<Word, kTables> of_one{};
  const std::size_t kept = std::min(descriptors.size(), kSample);
  for (std::size_t i = 0; i < kept; ++i) {
    words_of(descriptors[i * descriptors.size() / kept], of_one);
    words.insert(words.end(), of_one.begin(), of_one.end());
  }
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  for (const Word w : words) {
    std::vector<KeyFrameId>& who = postings_[w];
    who.insert(std::lower_bound(who.begin(), who.end(), id), id);
  }
}

void PlaceIndex::remove(KeyFrameId id) {
  const auto it = words_of_.find(id);
  if (it == words_of_.end()) return;
  for (const Word w : it->second) {
    std::vector<KeyFrameId>& who = postings_[w];
    who.erase(std::lower_bound(who.begin(), who.end(), id));
  }
  words_of_.erase(it);
}

std::vector<PlaceScore> PlaceIndex::query(std::span<const Descriptor> descriptors) const {
  std::vector<Word> words;
  std::array<Word, kTables> of_one{};
  for (const Descriptor& d : descriptors) {
    words_of(d, of_one);
    words.insert(words.end(), of_one.begin(), of_one.end());
  }
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  std::unordered_map<KeyFrameId, double> scores;
  for (const Word w : words) {
    const std::vector<KeyFrameId>& who = postings_[w];
    if (who.empty()) continue;
    const double worth = std::log1p(static_cast<double>(size()) / static_cast<double>(who.size()));
    for (const KeyFrameId id : who) scores[id] += worth;
  }
  std::vector<PlaceScore> out;
  out.reserve(scores.size());
  for (const auto& [id, score] : scores) out.push_back({id, score});
  std::sort(out.begin(), out.end(), [](const PlaceScore& a, const PlaceScore& b) {
    return a.score != b.score ? a.score > b.score : a.key_frame > b.key_frame;
  });
  return out;
}

}  // namespace semvslam
