// Weft's JSON files, told apart by their fields.
#pragma once

#include <google/protobuf/message.h>

#include <string>
#include <string_view>

namespace weft {

// "this is a board (board.json), and a rig (rig.json) is wanted": where `text`, which is no `wanted`, is a
// file of another kind. Empty where it is none, or too large to be looked at.
std::string OtherKind(std::string_view text, const google::protobuf::Message& wanted);

}  // namespace weft
