// What `view` shows of a run: point clouds, and the numbers of its JSON files.
#include <cmath>
#include <sstream>
#include <string>

#include "check.h"
#include "semvslam/web/ply_reader.h"
#include "semvslam/web/point_thinner.h"
#include "semvslam/web/run_facts.h"

using namespace semvslam;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::istringstream in(text);
  constexpr std::size_t kMost = 16;
  PointThinner thinner(kMost);
  const Result<PlyHeader> header = read_ply(in, "f", [&](const PlyVertex& point) { thinner.add(point); });
  if (header)
    FUZZ_CHECK(thinner.given() == header->vertices);
  else
    FUZZ_CHECK_MESSAGE(header.error());
  FUZZ_CHECK(thinner.points().size() <= kMost);
  for (const PlyVertex& point : thinner.points()) FUZZ_CHECK(point.position_m.allFinite());

  const RunFacts facts = describe_run(text, text);
  for (const Table& table : facts.tables)
    for (const auto& row : table.rows) FUZZ_CHECK(row.size() == table.columns.size());
  return 0;
}
