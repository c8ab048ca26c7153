// The schemas that declare services.
#pragma once

#include <google/protobuf/descriptor.h>

#include <vector>

namespace weft {

// All of weft.v1. Linked in, so that their methods are known even to a program that calls none.
std::vector<const google::protobuf::FileDescriptor*> ServiceFiles();

// Of all services, in the order of the files.
std::vector<const google::protobuf::MethodDescriptor*> ServiceMethods();
// "/weft.v1.Takes/StartTake", as HTTP/2 names the method.
std::string PathOf(const google::protobuf::MethodDescriptor& method);

}  // namespace weft
