#include "services/server/rpc/grpc_status.h"

#include <gmock/gmock.h>

#include "services/server/rpc/error_detail.h"

namespace weft {
namespace {

using ::testing::EndsWith;
using ::testing::StartsWith;

// What gRPC makes of it in a header: base64 of binary values, and percent signs for all but printable ASCII.
size_t BytesInHeaders(const grpc::Status& status) {
  size_t bytes = status.error_details().size() * 4 / 3 + 4;
  for (const char letter : status.error_message())
    bytes += letter >= ' ' && letter < 0x7f && letter != '%' ? 1 : 3;
  return bytes;
}

TEST(GrpcStatus, FitsIntoHeadersWhateverItQuotes) {
  for (const std::string& quoted :
       {std::string(1 << 20, '\x01'), std::string(1 << 20, '%'), std::string(5000, 'a'),
        std::string(5000, '\xc3'), std::string(5000, '\\')}) {
    const grpc::Status status = ToGrpcStatus(FieldError(
        absl::StatusCode::kInvalidArgument, {"spec.rig", "rig.json: the id " + quoted, "mend it"}));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), StartsWith("spec.rig: rig.json: the id "));
    EXPECT_THAT(status.error_message(), EndsWith(" ..."));
    EXPECT_LE(BytesInHeaders(status), 7500u);
  }
  std::string letters;
  for (int i = 0; i < 3000; ++i) letters += "\xc3\xa4";
  const std::string cut = ToGrpcStatus(absl::NotFoundError(letters)).error_message();
  EXPECT_EQ(cut, letters.substr(0, cut.size() - 4) + " ...");
  EXPECT_EQ(cut.size() % 2, 0u);
}

TEST(GrpcStatus, KeepsEveryCategoryBothWays) {
  for (int code = 1; code <= 16; ++code) {
    const absl::Status status(static_cast<absl::StatusCode>(code), "why");
    EXPECT_EQ(FromGrpcStatus(ToGrpcStatus(status)), status);
  }
  EXPECT_TRUE(FromGrpcStatus(ToGrpcStatus(absl::OkStatus())).ok());
}

TEST(GrpcStatus, KeepsWhatIsShort) {
  const absl::Status status =
      FieldError(absl::StatusCode::kNotFound, {"spec.dump", "/data/take: no such folder", "copy it there"});
  const absl::Status back = FromGrpcStatus(ToGrpcStatus(status));
  EXPECT_EQ(back.code(), status.code());
  EXPECT_EQ(back.message(), status.message());
  ASSERT_TRUE(DetailOf(back).has_value());
  EXPECT_EQ(DetailOf(back)->field(), "spec.dump");
  EXPECT_EQ(DetailOf(back)->remedy(), "copy it there");
}

}  // namespace
}  // namespace weft
