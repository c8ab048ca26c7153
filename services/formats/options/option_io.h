// Moves options between a struct of a stage and its message.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>

namespace weft {

// A struct's counterpart in options.proto, whose fields are found by name. Names that it lacks throw
// std::logic_error: they are mistakes of the program.
class OptionIo {
 public:
  // Reads: fields that the message has go to the struct. Writes: all values of the struct go to the message.
  static OptionIo Reading(const google::protobuf::Message& message) { return OptionIo(&message, nullptr); }
  static OptionIo Writing(google::protobuf::Message& message) { return OptionIo(&message, &message); }

  // The message in field `group`.
  OptionIo At(const char* group) const;

  void operator()(const char* name, bool& value) const;
  void operator()(const char* name, int& value) const;
  void operator()(const char* name, float& value) const;
  void operator()(const char* name, double& value) const;
  void operator()(const char* name, uint64_t& value) const;  // uint32 in the message

 private:
  OptionIo(const google::protobuf::Message* read, google::protobuf::Message* write)
      : read_(read), write_(write) {}

  const google::protobuf::Message* read_;
  google::protobuf::Message* write_;  // null when reading
};

}  // namespace weft
