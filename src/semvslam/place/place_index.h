#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/feature/features.h"

namespace semvslam {

/// How much a key frame looks like what was asked for; more is more alike, the scale depends on the index's content.
struct PlaceScore {
  KeyFrameId key_frame;
  double score = 0;
};

/// Says which key frames look like an image: an inverted index (Sivic and Zisserman, Video Google, ICCV 2003) whose
/// words are not trained but read off the descriptors: each of a few tables takes bits of its own choice, drawn once at
/// random (locality-sensitive hashing: Gionis et al., Similarity search in high dimensions via hashing, VLDB 1999). Two
/// views of one corner that differ in a tenth of the 256 bits share such a word in every second case. Rare words count
/// more. No file to load, nothing to fit to the place; a query takes about as long for a hundred key frames as for ten.
/// The same calls give the same answers. One writer.
class PlaceIndex {
 public:
  PlaceIndex();

  /// @param descriptors of the key frame; of many, evenly spread kSample are kept. An id that is there is replaced.
  void add(KeyFrameId id, std::span<const Descriptor> descriptors);
  /// Nothing happens to an id that is not there.
  void remove(KeyFrameId id);
  /// Every key frame that shares a word with these, most alike first (equal ones: the newer first).
  std::vector<PlaceScore> query(std::span<const Descriptor> descriptors) const;

  std::size_t size() const { return words_of_.size(); }

  static constexpr std::size_t kSample = 300;

 private:
  static constexpr std::size_t kTables = 4, kBits = 16;
  using Word = std::uint32_t;  // table and bits: an index into postings_

  void words_of(const Descriptor& descriptor, std::array<Word, kTables>& out) const;

  std::array<std::array<std::uint8_t, kBits>, kTables> bits_{};
  std::vector<std::vector<KeyFrameId>> postings_;     // per word, who has it; each once, ascending
  std::map<KeyFrameId, std::vector<Word>> words_of_;  // ascending
};

}  // namespace semvslam
