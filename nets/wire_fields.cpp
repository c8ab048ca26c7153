#include "nets/wire_fields.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <climits>

#include "base/status_macros.h"

namespace weft {

absl::Status VisitFields(std::string_view message,
                         const std::function<absl::Status(const WireField&)>& visit) {
  using google::protobuf::internal::WireFormatLite;
  const absl::Status damaged = absl::InvalidArgumentError("it is damaged, or no ONNX file");
  if (message.size() > INT_MAX) return damaged;
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const uint8_t*>(message.data()),
                                            static_cast<int>(message.size()));
  for (uint32_t tag = in.ReadTag(); tag != 0; tag = in.ReadTag()) {
    WireField field;
    field.number = WireFormatLite::GetTagFieldNumber(tag);
    switch (WireFormatLite::GetTagWireType(tag)) {
      case WireFormatLite::WIRETYPE_VARINT:
        if (!in.ReadVarint64(&field.value)) return damaged;
        break;
      case WireFormatLite::WIRETYPE_FIXED32: {
        uint32_t value = 0;
        if (!in.ReadLittleEndian32(&value)) return damaged;
        field.kind = WireField::Kind::kFourBytes;
        field.value = value;
        break;
      }
      case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
        uint32_t size = 0;
        if (!in.ReadVarint32(&size) || size > message.size() - static_cast<size_t>(in.CurrentPosition()))
          return damaged;
        field.kind = WireField::Kind::kBytes;
        field.bytes = message.substr(static_cast<size_t>(in.CurrentPosition()), size);
        if (!in.Skip(static_cast<int>(size))) return damaged;
        break;
      }
      default:
        return damaged;
    }
    if (field.number == 0) return damaged;
    WEFT_RETURN_IF_ERROR(visit(field));
  }
  // ReadTag gives 0 at the end, and for a tag that is none.
  return in.ConsumedEntireMessage() ? absl::OkStatus() : damaged;
}

}  // namespace weft
