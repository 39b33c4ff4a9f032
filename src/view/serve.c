#include "view/serve.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/file.h"

#define CLIENTS 32
#define REQUEST 8192 // bytes of a request's head
#define PATIENCE 20  // seconds without a byte either way
#define POLL_MS 200

typedef struct Client {
    int socket; // -1: free
    char head[REQUEST];
    size_t have;    // bytes of the request, then of the answer's head
    size_t sent;    // of the answer's head
    bool answering; // the request is read
    int file;       // -1: none
    off_t at, size; // of the file
    double last;    // when a byte went either way
} Client;

// ---- what may be asked for ----

static const struct {
    const char *ext, *type;
} types[] = {{"html", "text/html; charset=utf-8"},
             {"js", "text/javascript; charset=utf-8"},
             {"jpg", "image/jpeg"},
             {"png", "image/png"},
             {"mp4", "video/mp4"}};

static const char *type_of(const char *path)
{
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (fs_file_has_ext(path, types[i].ext)) return types[i].type;
    return "application/octet-stream";
}

static bool is_plain(const char *name)
{
    if (!*name || *name == '.') return false;
    for (; *name; name++)
        if (!isalnum((unsigned char)*name) && !strchr("._-", *name)) return false;
    return true;
}

// Opens what a request's path means, -1 where that is nothing we give.
static int open_asked(const char *dir, const char *path, off_t *size)
{
    static const char *const folders[] = {"report/", "progress/", "video/", "export/"};
    const char *name = NULL, *file = strcmp(path, "/") == 0 ? "/index.html" : path;
    char folder[16] = ".";
    if (strcmp(file, "/index.html") == 0 || strcmp(file, "/sheet.png") == 0) name = file + 1;
    for (size_t i = 0; i < sizeof folders / sizeof *folders && !name; i++)
        if (strncmp(file + 1, folders[i], strlen(folders[i])) == 0) {
            snprintf(folder, sizeof folder, "%s", folders[i]);
            name = file + 1 + strlen(folders[i]);
        }
    if (*file != '/' || !name || !is_plain(name)) return -1;
    int top = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC), in = -1, fd = -1;
    folder[strcspn(folder, "/")] = 0; // with a slash behind it a link would be followed
    if (top >= 0) in = openat(top, folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (in >= 0) fd = openat(in, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (top >= 0) close(top);
    if (in >= 0) close(in);
    struct stat st;
    if (fd >= 0 && (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))) {
        close(fd);
        fd = -1;
    }
    if (fd >= 0) *size = st.st_size;
    return fd;
}

// ---- one client ----

static void drop(Client *c)
{
    if (c->file >= 0) close(c->file);
    close(c->socket);
    c->file = c->socket = -1;
}

static void answer(Client *c, const char *status, const char *type, off_t size)
{
    c->have = (size_t)snprintf(c->head, sizeof c->head,
                               "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %lld\r\nCache-Control: no-store\r\n"
                               "X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\n"
                               "Connection: close\r\n\r\n",
                               status, type, (long long)size);
    c->sent = 0;
    c->answering = true;
}

// The value of the header Host is this machine's own name for itself.
static bool is_host_ours(const char *head)
{
    for (const char *line = strstr(head, "\r\n"); line; line = strstr(line + 2, "\r\n")) {
        if (strncasecmp(line + 2, "host:", 5) != 0) continue;
        const char *host = line + 7 + strspn(line + 7, " \t");
        size_t n = strcspn(host, ":\r ");
        return (n == 9 && strncasecmp(host, "127.0.0.1", n) == 0) || (n == 9 && strncasecmp(host, "localhost", n) == 0);
    }
    return false;
}

static void read_request(Client *c, const char *dir)
{
    ssize_t n = recv(c->socket, c->head + c->have, sizeof c->head - 1 - c->have, 0);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (n <= 0) {
        drop(c);
        return;
    }
    c->have += (size_t)n;
    c->head[c->have] = 0;
    if (!strstr(c->head, "\r\n\r\n")) {
        if (c->have == sizeof c->head - 1) answer(c, "431 Request Header Fields Too Large", "text/plain", 0);
        return;
    }
    char method[8], path[256];
    bool whole = sscanf(c->head, "%7s %255s HTTP/1.", method, path) == 2;
    bool get = whole && strcmp(method, "GET") == 0, head_only = whole && strcmp(method, "HEAD") == 0;
    if (!get && !head_only) {
        answer(c, "405 Method Not Allowed", "text/plain", 0);
    } else if (!is_host_ours(c->head)) {
        answer(c, "403 Forbidden", "text/plain", 0);
    } else {
        path[strcspn(path, "?")] = 0;
        c->at = c->size = 0;
        c->file = open_asked(dir, path, &c->size);
        const char *name = strcmp(path, "/") == 0 ? "index.html" : path;
        answer(c, c->file < 0 ? "404 Not Found" : "200 OK", c->file < 0 ? "text/plain" : type_of(name), c->size);
        if (head_only) c->size = 0;
    }
}

static void write_answer(Client *c)
{
    char chunk[65536];
    ssize_t n;
    if (c->sent < c->have) {
        n = send(c->socket, c->head + c->sent, c->have - c->sent, MSG_NOSIGNAL);
        if (n > 0) c->sent += (size_t)n;
    } else {
        off_t left = c->size - c->at;
        n = c->file < 0 || left <= 0
                ? 0
                : pread(c->file, chunk, left < (off_t)sizeof chunk ? (size_t)left : sizeof chunk, c->at);
        if (n > 0) n = send(c->socket, chunk, (size_t)n, MSG_NOSIGNAL);
        if (n > 0) c->at += n;
        if (n == 0) drop(c); // all is sent, or the file got shorter
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) drop(c);
}

// ---- all of them ----

static void admit(const Server *server, Client *client)
{
    int s = accept4(server->socket, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC), i = 0;
    if (s < 0) return;
    while (i < CLIENTS && client[i].socket >= 0) i++;
    if (i == CLIENTS) close(s);
    if (i < CLIENTS) client[i] = (Client){.socket = s, .file = -1, .last = fs_clock_seconds()};
}

static void attend(const Server *server, Client *c, const struct pollfd *heard, double now)
{
    if (heard->revents) {
        c->last = now;
        if (c->answering)
            write_answer(c);
        else
            read_request(c, server->dir);
    } else if (now - c->last > PATIENCE) {
        drop(c);
    }
}

void fs_serve_until_cancelled(const Server *server, const Log *log)
{
    static Client client[CLIENTS];
    for (int i = 0; i < CLIENTS; i++) client[i] = (Client){.socket = -1, .file = -1};
    while (!fs_log_cancelled(log)) {
        struct pollfd list[CLIENTS + 1] = {{.fd = server->socket, .events = POLLIN}};
        for (int i = 0; i < CLIENTS; i++)
            list[1 + i] = (struct pollfd){.fd = client[i].socket, .events = client[i].answering ? POLLOUT : POLLIN};
        if (poll(list, CLIENTS + 1, POLL_MS) < 0 && errno != EINTR) break;
        double now = fs_clock_seconds();
        for (int i = 0; i < CLIENTS; i++)
            if (client[i].socket >= 0) attend(server, &client[i], &list[1 + i], now);
        if (list[0].revents) admit(server, client);
    }
    for (int i = 0; i < CLIENTS; i++)
        if (client[i].socket >= 0) drop(&client[i]);
}

int fs_serve_open(Server *server, const char *dir, int port, FsError *err)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    socklen_t size = sizeof at;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    *server = (Server){.socket = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0), .dir = dir};
    int on = 1;
    if (server->socket >= 0) setsockopt(server->socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (server->socket < 0 || bind(server->socket, (struct sockaddr *)&at, sizeof at) != 0 ||
        listen(server->socket, CLIENTS) != 0 || getsockname(server->socket, (struct sockaddr *)&at, &size) != 0)
        return fs_error_set(err, FS_ERR_IO, "127.0.0.1:%d: cannot serve there: %s; give another --port", port,
                            strerror(errno));
    server->port = ntohs(at.sin_port);
    return 0;
}

void fs_serve_close(Server *server)
{
    if (server->socket >= 0) close(server->socket);
    server->socket = -1;
}
