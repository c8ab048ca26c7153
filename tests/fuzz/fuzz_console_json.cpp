// Requests of all methods as the JSON of browsers: "Takes.StartTake {...}".
#include <google/protobuf/message.h>

#include <memory>

#include "services/formats/files/json_file.h"
#include "services/server/console/json_messages.h"
#include "services/server/rpc/service_files.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// Some value in each field, three messages deep.
void Fill(Message& message, int depth) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    const auto* set = message.GetReflection();
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      if (depth == 0 || field->is_map()) continue;
      Fill(*(field->is_repeated() ? set->AddMessage(&message, field) : set->MutableMessage(&message, field)),
           depth - 1);
    } else if (field->is_repeated()) {
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) set->AddString(&message, field, "a");
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
      set->SetString(&message, field, field->type() == FieldDescriptor::TYPE_BYTES ? "\x01\xff" : "a");
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_INT64) {
      set->SetInt64(&message, field, 1);
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
      set->SetDouble(&message, field, 0.5);
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
      set->SetEnumValue(&message, field, 1);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const size_t space = bytes.find(' ');
  if (space == std::string_view::npos) return 0;
  const auto* method = weft::FindMethod(bytes.substr(0, space));
  if (method == nullptr) return 0;
  const std::string_view json = bytes.substr(space + 1);
  const auto wire = weft::RequestOfJson(*method->input_type(), json);
  if (!wire.ok()) {
    weft::FuzzRequire(!wire.status().message().empty());
    return 0;
  }
  weft::FuzzRequire(weft::CheckJsonLimits(json, "", {.values = 20'000, .depth = 30}).ok());
  // What it was read as is read as the same again.
  const auto said = weft::JsonOfAnswer(*method->input_type(), *wire);
  weft::FuzzRequire(said.ok());
  const auto again = weft::RequestOfJson(*method->input_type(), *said);
  weft::FuzzRequire(again.ok() && *weft::JsonOfAnswer(*method->input_type(), *again) == *said, *said);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::vector<std::string> seeds;
  for (const auto* method : ServiceMethods()) {
    const std::unique_ptr<Message> message(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(method->input_type())->New());
    Fill(*message, 3);
    seeds.push_back(method->service()->name() + "." + method->name() + " " + JsonOf(*message));
  }
  seeds.push_back("Takes.StartTake {\"recording\":" + std::string(29, '[') + std::string(29, ']') + "}");
  return seeds;
}
