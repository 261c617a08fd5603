// Protects a session from a second process that plays the same part in it.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include <gtest/gtest.h>

#include "vest_tissue/shared/session_lock.h"

using vest::shared::SessionLock;
using vest::shared::SessionTaken;

namespace {

class Lock : public ::testing::Test {
 protected:
  const std::string name_ = "/vest_test_lock_" + std::to_string(::getpid());
  void TearDown() override { ::shm_unlink(name_.c_str()); }

  /// A process that holds the lock until it is killed.
  pid_t holder() {
    int told[2];
    EXPECT_EQ(::pipe(told), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      const SessionLock lock("other", name_);
      char done = 1;
      if (::write(told[1], &done, 1) != 1) ::_exit(1);
      for (;;) ::pause();
    }
    char done = 0;
    EXPECT_EQ(::read(told[0], &done, 1), 1);
    ::close(told[0]);
    ::close(told[1]);
    return child;
  }
  static void end(pid_t child) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
};

TEST_F(Lock, ASecondHolderIsRefusedByOneSentenceThatNamesThePart) {
  const pid_t child = holder();
  try {
    const SessionLock second("the simulation", name_);
    ADD_FAILURE() << "two at once";
  } catch (const SessionTaken& e) {
    EXPECT_EQ(
        std::string(e.what()).rfind("the simulation of this session already runs in another process", 0), 0U)
        << e.what();
  }
  end(child);
  const SessionLock third("the simulation", name_);  // what was killed holds nothing
}

TEST_F(Lock, TwoInOneProcessAreTwo) {
  const SessionLock first("a", name_);
  EXPECT_THROW(SessionLock("b", name_), SessionTaken);
}

TEST_F(Lock, WhoWasToldToEndHasTimeToDoIt) {
  const pid_t child = holder();
  const pid_t reaper = ::fork();
  if (reaper == 0) {
    ::usleep(200000);
    ::kill(child, SIGKILL);
    ::_exit(0);
  }
  EXPECT_NO_THROW(SessionLock("next", name_, 60.0));
  ::waitpid(reaper, nullptr, 0);
  ::waitpid(child, nullptr, 0);
}

TEST_F(Lock, WhoDiedWithoutLettingGoIsSeenUntilSomebodySettlesIt) {
  EXPECT_FALSE(SessionLock("first", name_).predecessorDied());
  EXPECT_FALSE(SessionLock("second", name_).predecessorDied()) << "the first let go";
  end(holder());
  EXPECT_TRUE(SessionLock("third", name_).predecessorDied());
  {
    SessionLock fourth("fourth", name_);
    EXPECT_TRUE(fourth.predecessorDied()) << "that the third let go settles nothing";
    fourth.settle();
    EXPECT_FALSE(fourth.predecessorDied());
  }
  EXPECT_FALSE(SessionLock("fifth", name_).predecessorDied());
}

TEST_F(Lock, WithoutSharedMemoryTheReasonIsTheSystems) {
  try {
    const SessionLock lock("a", "/no/such/place");
    ADD_FAILURE();
  } catch (const SessionTaken&) {
    ADD_FAILURE() << "nobody holds it";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("/no/such/place"), std::string::npos) << e.what();
  }
}

}  // namespace
