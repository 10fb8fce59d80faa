#include "semvslam/semantic/roles.h"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include "semvslam/base/foreign_text.h"

namespace semvslam {

std::string_view to_string(Role role) {
  switch (role) {
    case Role::kStatic:
      return "static";
    case Role::kMovable:
      return "movable";
    case Role::kDynamic:
      break;
  }
  return "dynamic";
}

RoleTable::RoleTable() {
  for (const char* name : {"person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat",
                           "bird", "cat", "dog", "horse", "sheep", "cow", "elephant", "bear", "zebra", "giraffe"})
    roles_[name] = Role::kDynamic;
  for (const char* name : {"chair", "book", "cup"}) roles_[name] = Role::kMovable;
}

Result<RoleTable> RoleTable::from_yaml(const std::string& text, const std::string& origin) {
  const auto wrong = [&](const std::string& what) { return Error{ErrorCode::kInvalidInput, origin + ": " + what}; };
  RoleTable table;
  table.roles_.clear();
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) return wrong("expected a mapping of roles to class names, like `dynamic: [person]`");
    for (const auto& entry : root) {
      const auto name = entry.first.as<std::string>();
      Role role;
      if (name == "dynamic")
        role = Role::kDynamic;
      else if (name == "movable")
        role = Role::kMovable;
      else if (name == "static")
        role = Role::kStatic;
      else
        return wrong(fmt::format("unknown role {}; known: dynamic, movable, static", in_quotes(name)));
      if (!entry.second.IsSequence()) return wrong(fmt::format("{} must be a list of class names", in_quotes(name)));
      for (const auto& item : entry.second) {
        const auto class_name = item.as<std::string>();
        if (!table.roles_.emplace(class_name, role).second)
          return wrong(fmt::format("class {} is named twice", in_quotes(class_name)));
      }
    }
  } catch (const YAML::Exception& e) {
    return wrong(fmt::format("line {}: not valid: {}", e.mark.line + 1, in_quotes(e.msg)));
  }
  return table;
}

Role RoleTable::role(std::string_view class_name) const {
  const auto it = roles_.find(class_name);
  return it == roles_.end() ? Role::kStatic : it->second;
}

}  // namespace semvslam
