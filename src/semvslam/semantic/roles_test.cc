#include "semvslam/semantic/roles.h"

#include <gmock/gmock.h>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

TEST(Roles, DefaultsAreThoseOfTheShippedNetwork) {
  const RoleTable table;
  EXPECT_EQ(table.role("person"), Role::kDynamic);
  EXPECT_EQ(table.role("giraffe"), Role::kDynamic);
  EXPECT_EQ(table.role("cup"), Role::kMovable);
  EXPECT_EQ(table.role("table"), Role::kStatic);
}

TEST(Roles, YamlReplacesTheDefaults) {
  const Result<RoleTable> table = RoleTable::from_yaml("dynamic: [robot]\nmovable: [box, bag]\n", "roles.yaml");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->role("robot"), Role::kDynamic);
  EXPECT_EQ(table->role("bag"), Role::kMovable);
  EXPECT_EQ(table->role("person"), Role::kStatic);
}

TEST(Roles, ErrorsNameTheFileAndTheFault) {
  for (const auto& [text, fault] :
       std::initializer_list<std::pair<const char*, const char*>>{{"[a, b]", "mapping"},
                                                                  {"moving: [a]", "unknown role 'moving'"},
                                                                  {"dynamic: a", "list"},
                                                                  {"dynamic: [a]\nmovable: [a]", "named twice"},
                                                                  {"dynamic: [a", ""}}) {
    const Result<RoleTable> table = RoleTable::from_yaml(text, "roles.yaml");
    ASSERT_FALSE(table) << text;
    EXPECT_THAT(table.error().message, HasSubstr("roles.yaml"));
    EXPECT_THAT(table.error().message, HasSubstr(fault));
  }
}

}  // namespace
}  // namespace semvslam
