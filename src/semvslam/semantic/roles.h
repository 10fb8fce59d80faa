#pragma once

#include <map>
#include <string>
#include <string_view>

#include "semvslam/base/result.h"

namespace semvslam {

/// How far an object of a class can be trusted to stay where it is.
enum class Role {
  kStatic,   // furniture, walls: everything that is not listed
  kMovable,  // moves only when somebody moves it: chair, book, cup
  kDynamic,  // moves by itself: persons, animals, vehicles
};

std::string_view to_string(Role role);

/// Which role each class name has. Data, not code: see from_yaml().
class RoleTable {
 public:
  /// The roles of the shipped network: person and 18 other movers are dynamic, chair, book and cup movable.
  RoleTable();
  /// From a YAML mapping of role to class names: `dynamic: [person, dog]`, `movable: [chair]`; everything else is
  /// static. Errors: no mapping, an unknown role, a class named twice.
  static Result<RoleTable> from_yaml(const std::string& text, const std::string& origin);
  Role role(std::string_view class_name) const;

 private:
  std::map<std::string, Role, std::less<>> roles_;
};

}  // namespace semvslam
