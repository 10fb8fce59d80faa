// Saved maps: files as they are, and what lies behind the checksum, which would keep a fuzzer out.
#include <cstring>
#include <memory>
#include <string>

#include "check.h"
#include "semvslam/map/map_content.h"
#include "semvslam/map/map_file.h"
#include "semvslam/map/map_file_test_support.h"

using namespace semvslam;

namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

void check(const Result<Map>& map) {
  if (!map) {
    FUZZ_CHECK_MESSAGE(map.error());
    return;
  }
  FUZZ_CHECK(map->check_invariants().ok());
  const std::string file = format_map(*map);
  const Result<Map> again = parse_map(bytes_of(file), "g");
  FUZZ_CHECK(again.ok());
  FUZZ_CHECK(format_map(*again) == file);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

/// Begins with a map that is whole: no fuzzer guesses one.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned) {
  static const std::string whole = format_map_content(testing_support::busy_map(7));
  if (size < 64 && whole.size() <= max_size) {
    std::memcpy(data, whole.data(), whole.size());
    size = whole.size();
  }
  return LLVMFuzzerMutate(data, size, max_size);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check(parse_map({data, size}, "f"));
  check(parse_map_content({data, size}, "f"));
  return 0;
}
