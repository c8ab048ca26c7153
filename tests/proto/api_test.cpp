// Guards the gRPC API: what a client of v1 was built with stays as it is.
//
// tests/data/api/v1.txt lists every method, field and enum value. WEFT_WRITE_API=1 bin/api_test adds new ones
// to it, and takes none out.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/rpc/service_files.h"
#include "weft/v1/access.pb.h"

namespace weft {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::ServiceDescriptor;

// What services, and all messages that they send or receive, look like from outside.
class ApiText {
 public:
  void Add(const FileDescriptor& file) {
    for (int i = 0; i < file.service_count(); ++i) Add(*file.service(i));
  }
  const std::set<std::string>& lines() const { return lines_; }

 private:
  void Add(const ServiceDescriptor& service) {
    for (int i = 0; i < service.method_count(); ++i) {
      const google::protobuf::MethodDescriptor& method = *service.method(i);
      lines_.insert(absl::StrCat("rpc ", method.full_name(), " (", method.client_streaming() ? "stream " : "",
                                 method.input_type()->full_name(), ") returns (",
                                 method.server_streaming() ? "stream " : "",
                                 method.output_type()->full_name(), ")"));
      Add(*method.input_type());
      Add(*method.output_type());
    }
  }

  void Add(const Descriptor& message) {
    if (!seen_.insert(message.full_name()).second) return;
    for (int i = 0; i < message.field_count(); ++i) {
      const FieldDescriptor& field = *message.field(i);
      const char* label = field.is_repeated() ? "repeated " : field.has_presence() ? "optional " : "";
      std::string type = field.type_name();
      if (field.message_type() != nullptr) type = field.message_type()->full_name();
      if (field.enum_type() != nullptr) type = field.enum_type()->full_name();
      lines_.insert(absl::StrCat("field ", field.full_name(), " = ", field.number(), " ", label, type));
      if (field.message_type() != nullptr) Add(*field.message_type());
      if (field.enum_type() != nullptr) Add(*field.enum_type());
    }
  }

  void Add(const EnumDescriptor& type) {
    for (int i = 0; i < type.value_count(); ++i)
      lines_.insert(absl::StrCat("value ", type.full_name(), ".", type.value(i)->name(), " = ",
                                 type.value(i)->number()));
  }

  std::set<std::string> lines_, seen_;
};

std::set<std::string> ApiLines() {
  ApiText text;
  for (const FileDescriptor* file : ServiceFiles()) text.Add(*file);
  return text.lines();
}

std::vector<std::string> Without(const std::set<std::string>& all, const std::set<std::string>& taken) {
  std::vector<std::string> left;
  std::set_difference(all.begin(), all.end(), taken.begin(), taken.end(), std::back_inserter(left));
  return left;
}

TEST(Api, KeepsWhatClientsOfV1WereBuiltWith) {
  const std::string path = std::string(WEFT_SOURCE) + "/tests/data/api/v1.txt";
  const std::set<std::string> now = ApiLines();
  const absl::StatusOr<std::string> text = ReadWholeFile(path);
  ASSERT_TRUE(text.ok()) << text.status();
  const std::set<std::string> was = absl::StrSplit(*text, '\n', absl::SkipEmpty());
  const std::vector<std::string> gone = Without(was, now);
  EXPECT_THAT(gone, testing::IsEmpty())
      << "these are gone or changed, which breaks clients; keep them, and add what is new under new numbers";
  if (gone.empty() && std::getenv("WEFT_WRITE_API") != nullptr) {
    ASSERT_TRUE(WriteFileAtomically(path, absl::StrCat(absl::StrJoin(now, "\n"), "\n")).ok());
    return;
  }
  EXPECT_THAT(Without(now, was), testing::IsEmpty())
      << "these are new; WEFT_WRITE_API=1 bin/api_test adds them to " << path;
}

TEST(Api, IsThatOfAllFilesThatDeclareServices) {
  std::set<std::string> known, declared;
  for (const FileDescriptor* file : ServiceFiles()) known.insert(file->name());
  const std::filesystem::path root = std::string(WEFT_SOURCE) + "/proto";
  for (const auto& entry : std::filesystem::directory_iterator(root / "weft/v1")) {
    const absl::StatusOr<std::string> text = ReadWholeFile(entry.path());
    ASSERT_TRUE(text.ok()) << text.status();
    if (text->find("\nservice ") != std::string::npos)
      declared.insert(std::filesystem::relative(entry.path(), root).string());
  }
  EXPECT_EQ(known, declared);
}

TEST(Api, EveryMethodSaysWhoMayCallIt) {
  for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
    EXPECT_NE(method->options().GetExtension(v1::role), v1::ROLE_UNSPECIFIED)
        << method->full_name() << ": give it the option (role); access.proto says what the roles are";
  }
}

}  // namespace
}  // namespace weft
