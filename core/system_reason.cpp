#include "core/system_reason.h"

#include <cerrno>
#include <system_error>

namespace atelier {
namespace {

const char* advice(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "; free space and run again";
    case EACCES:
    case EPERM:
      return "; ask whom it belongs to, or name a place that you may use";
    case EROFS:
      return "; name a folder that can be written";
    case EAGAIN:
      return "; use fewer --jobs, or end other programs";
    case ENAMETOOLONG:
      return "; give it a shorter name";
    case ENOTDIR:
      return "; a file lies where a folder is expected";
    default:
      return "";
  }
}

}  // namespace

std::string system_reason(int error) {
  return std::generic_category().message(error) + advice(error);
}

}  // namespace atelier
