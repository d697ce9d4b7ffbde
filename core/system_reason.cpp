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
    case ENOMEM:
      return "; use fewer --jobs, or end other programs";
    case EMFILE:
      return "; raise the limit of open files (ulimit -n), or use fewer --jobs";
    case ENFILE:
      return "; end other programs, which have all files open that the system allows";
    case EIO:
      return "; the disk or the way to it fails: read the system's log, and use another disk";
    case EFBIG:
      return "; raise the limit of file sizes (ulimit -f), or name a disk that takes larger files";
    case ENOENT:
      return "; look whether the path is right, and whether it was removed meanwhile";
    case EEXIST:
    case ENOTEMPTY:
      return "; remove it, or name another place";
    case ENAMETOOLONG:
      return "; give it a shorter name";
    case ENOTDIR:
      return "; name another place: a file lies where a folder is expected";
    case EISDIR:
      return "; name another place: a folder lies where a file is expected";
    case ELOOP:
      return "; symbolic links lead in a circle: name what they were to lead to";
    case EBUSY:
    case ETXTBSY:
      return "; end the program that uses it";
    case ESTALE:
    case ENOTCONN:
    case ETIMEDOUT:
      return "; the network's disk is away: mount it again, and run again";
    case ENOLCK:
    case EOPNOTSUPP:
      return "; this file system cannot do that: name a place on another";
    case EPIPE:
      return "; what was to read it has ended";
    default:
      return "";
  }
}

}  // namespace

std::string system_reason(int error) {
  return std::generic_category().message(error) + advice(error);
}

}  // namespace atelier
