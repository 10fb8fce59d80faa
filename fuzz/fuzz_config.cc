// Configuration files, --set arguments and suites: loading never crashes, changes nothing on error, and what is dumped
// loads again.
#include <string>

#include "check.h"
#include "semvslam/base/config_schema.h"
#include "semvslam/base/yaml_scalars.h"

using namespace semvslam;

namespace {

struct Options {
  int features = 1000;
  double scale = 1.2;
  bool deterministic = false;
  std::string mode = "orb", folder = "out";

  ConfigSchema schema() {
    ConfigSchema s;
    s.add("orb.features", &features, {1, 100000}, "Features per image");
    s.add("orb.scale", &scale, {1.01, 4}, "Factor between pyramid levels");
    s.add("run.deterministic", &deterministic, "One thread, fixed order");
    s.add("run.mode", &mode, {"orb", "masks", "full"}, "What is removed");
    s.add("run.out.folder", &folder, {}, "Where results go");
    return s;
  }
};

void check_scalars(const std::string& text) {
  const auto scalars = yaml_scalars(text, "f");
  if (!scalars) {
    FUZZ_CHECK_MESSAGE(scalars.error());
    return;
  }
  FUZZ_CHECK(scalars->size() <= 10'000);
  for (const YamlScalar& scalar : *scalars) FUZZ_CHECK(!scalar.path.empty() && scalar.where.starts_with("f:"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const bool assignment : {false, true}) {
    Options options;
    ConfigSchema schema = options.schema();
    const std::string before = schema.dump_yaml();
    const Status status = assignment ? schema.set(text) : schema.load_yaml(text, "f");
    const std::string after = schema.dump_yaml();
    if (!status) {
      FUZZ_CHECK_MESSAGE(status.error());
      FUZZ_CHECK(before == after);
      continue;
    }
    FUZZ_CHECK(options.features >= 1 && options.features <= 100000);
    FUZZ_CHECK(options.scale >= 1.01 && options.scale <= 4);
    Options copy;
    ConfigSchema copy_schema = copy.schema();
    FUZZ_CHECK(copy_schema.load_yaml(after, "g").ok());
    FUZZ_CHECK(copy_schema.dump_yaml() == after);
  }
  check_scalars(text);
  return 0;
}
