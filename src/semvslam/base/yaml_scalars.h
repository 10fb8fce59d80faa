#pragma once

#include <string>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// One value of a YAML document and where it stands.
struct YamlScalar {
  std::string path;   // keys and positions in lists, joined by dots: "sequences.0.people"
  std::string value;  // as written
  std::string where;  // "file:line", for messages
};

/// All values of a YAML document in the order in which they stand. Errors, with file and line: not valid YAML, a key
/// that is no plain word, a key that is set twice, a key without a value (also an empty list or section), too deeply
/// nested, more than 1 MB of text or 10,000 values.
Result<std::vector<YamlScalar>> yaml_scalars(const std::string& text, const std::string& origin);

}  // namespace semvslam
