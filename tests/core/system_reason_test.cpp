#include "core/system_reason.h"

#include <cerrno>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::HasSubstr;

TEST(SystemReason, CommonErrors_SayWhatToDo) {
  for (const int error :
       {ENOSPC, EDQUOT,  EACCES, EPERM,    EROFS,     EAGAIN,       ENOMEM,     EMFILE, ENFILE,
        EIO,    EFBIG,   ENOENT, EEXIST,   ENOTEMPTY, ENAMETOOLONG, ENOTDIR,    EISDIR, ELOOP,
        EBUSY,  ETXTBSY, ESTALE, ENOTCONN, ETIMEDOUT, ENOLCK,       EOPNOTSUPP, EPIPE}) {
    EXPECT_THAT(system_reason(error), HasSubstr("; ")) << error;
  }
  EXPECT_THAT(system_reason(EIO), HasSubstr("use another disk"));
  EXPECT_THAT(system_reason(EFBIG), HasSubstr("ulimit -f"));
  EXPECT_THAT(system_reason(EMFILE), HasSubstr("ulimit -n"));
}

TEST(SystemReason, OtherErrors_GiveTheSystemTextOnly) {
  EXPECT_EQ(system_reason(EDOM), "Numerical argument out of domain");
}

}  // namespace
}  // namespace atelier
