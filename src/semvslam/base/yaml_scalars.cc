#include "semvslam/base/yaml_scalars.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "semvslam/base/foreign_text.h"
#include "semvslam/base/yaml_limits.h"

namespace semvslam {
namespace {

constexpr std::size_t kMaxScalars = 10'000;  // aliases can make many of a short text

bool is_plain_word(const std::string& key) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '.' || c == '-'; };
  return !key.empty() && std::all_of(key.begin(), key.end(), plain);
}

struct Collector {
  const std::string& origin;
  std::vector<YamlScalar> found;
  std::set<std::string> paths;

  std::string where(const YAML::Node& node) const { return fmt::format("{}:{}", origin, node.Mark().line + 1); }

  Status visit_list(const YAML::Node& list, const std::string& path, int depth) {
    std::size_t position = 0;
    for (const auto& item : list)
      if (Status status = visit(item, fmt::format("{}.{}", path, position++), where(item), depth + 1); !status)
        return status;
    return Status::success();
  }

  Status visit_map(const YAML::Node& map, const std::string& path, int depth) {
    for (const auto& item : map) {
      if (!item.first.IsScalar() || !is_plain_word(item.first.Scalar()))
        return invalid_input(fmt::format("{}: keys must be plain words", where(item.first)));
      const std::string below = path.empty() ? item.first.Scalar() : path + '.' + item.first.Scalar();
      if (Status status = visit(item.second, below, where(item.first), depth + 1); !status) return status;
    }
    return Status::success();
  }

  Status visit(const YAML::Node& node, const std::string& path, const std::string& at, int depth) {
    if (depth > kMaxYamlNesting) return invalid_input(fmt::format("{}: nested too deeply", at));
    if (node.IsScalar()) {
      if (!paths.insert(path).second) return invalid_input(fmt::format("{}: {} is set twice", at, in_quotes(path)));
      if (found.size() == kMaxScalars) return invalid_input(fmt::format("{}: more than {} values", at, kMaxScalars));
      found.push_back({path, node.Scalar(), at});
      return Status::success();
    }
    if (!(node.IsMap() || node.IsSequence()) || node.size() == 0)
      return invalid_input(fmt::format("{}: {} has no value", at, in_quotes(path)));
    return node.IsMap() ? visit_map(node, path, depth) : visit_list(node, path, depth);
  }
};

}  // namespace

Result<std::vector<YamlScalar>> yaml_scalars(const std::string& text, const std::string& origin) {
  if (text.size() > kMaxYamlBytes) return invalid_input(origin + ": such a file has less than 1 MB");
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return std::vector<YamlScalar>();
    if (!root.IsMap()) return invalid_input(origin + ":1: expected 'key: value' lines");
    Collector collector{origin, {}, {}};
    if (Status status = collector.visit_map(root, "", 0); !status) return status.error();
    return std::move(collector.found);
  } catch (const YAML::Exception& e) {
    return invalid_input(fmt::format("{}:{}: not valid YAML: {}", origin, e.mark.line + 1, in_quotes(e.msg)));
  }
}

}  // namespace semvslam
