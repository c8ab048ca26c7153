#include "base/named_status.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(Naming, PutsTheNameBeforeTheError) {
  const absl::Status named = Naming("rig.json", absl::NotFoundError("no such file"));
  EXPECT_EQ(named, absl::NotFoundError("rig.json: no such file"));
  EXPECT_TRUE(Naming("rig.json", absl::OkStatus()).ok());
}

TEST(Naming, LeavesValuesAlone) {
  EXPECT_EQ(Naming("rig.json", absl::StatusOr<int>(3)).value(), 3);
  EXPECT_EQ(Naming("rig.json", absl::StatusOr<int>(absl::DataLossError("ends"))).status(),
            absl::DataLossError("rig.json: ends"));
}

}  // namespace
}  // namespace weft
