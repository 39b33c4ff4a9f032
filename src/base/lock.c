#include "base/lock.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static int open_file(const char *path)
{
    int fd = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (fd < 0 && (errno == EACCES || errno == EROFS)) fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    return fd;
}

bool fs_lock_take(Lock *lock, const char *path)
{
    for (int again = 3; !lock->held; again--) {
        struct stat st;
        int fd = open_file(path);
        if (fd < 0) return true;
        if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
            bool other = errno == EWOULDBLOCK;
            close(fd);
            return !other;
        }
        if (again && fstat(fd, &st) == 0 && st.st_nlink == 0) // removed meanwhile: locks nothing
            close(fd);
        else
            *lock = (Lock){true, fd};
    }
    return true;
}

void fs_lock_release(Lock *lock)
{
    if (lock->held) close(lock->fd);
    *lock = (Lock){0};
}
