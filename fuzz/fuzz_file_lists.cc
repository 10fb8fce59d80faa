// rgb.txt, depth.txt and associations.txt.
#include <cmath>
#include <string_view>

#include "check.h"
#include "semvslam/data/tum_files.h"

using namespace semvslam;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Result<FileList> list = parse_file_list(text, "f");
  if (list) {
    for (std::size_t i = 1; i < list->entries.size(); ++i)
      FUZZ_CHECK(list->entries[i - 1].stamp < list->entries[i].stamp);
    // A list fits itself: every image pairs with its own stamp.
    const PairList pairs = associate(*list, *list, 0.02);
    FUZZ_CHECK(pairs.pairs.size() == list->entries.size());
    for (const ImagePair& pair : pairs.pairs) FUZZ_CHECK(pair.colour_file == pair.depth_file);
  } else {
    FUZZ_CHECK_MESSAGE(list.error());
  }
  const Result<PairList> pairs = parse_associations(text, "f");
  if (pairs) {
    for (std::size_t i = 1; i < pairs->pairs.size(); ++i) FUZZ_CHECK(pairs->pairs[i - 1].stamp < pairs->pairs[i].stamp);
  } else {
    FUZZ_CHECK_MESSAGE(pairs.error());
  }
  return 0;
}
