#include "view/serve.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
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
    off_t at, size; // of the file: the next byte, where the answer ends
    double last;    // when a byte went either way
} Client;

// ---- what may be asked for ----

static const struct {
    const char *ext, *type;
} types[] = {{"html", "text/html; charset=utf-8"},
             {"js", "text/javascript; charset=utf-8"},
             {"jpg", "image/jpeg"},
             {"png", "image/png"},
             {"mp4", "video/mp4"},
             {"json", "application/json"},
             {"jsonl", "text/plain; charset=utf-8"},
             {"tif", "image/tiff"}};

static const char *type_of(const char *path)
{
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (fs_file_has_ext(path, types[i].ext)) return types[i].type;
    return "application/octet-stream";
}

// A file's name out of a request, %41 as A. False where it is none that we give: empty, hidden, or with a folder in it.
static bool get_name(const char *asked, char *name, size_t size)
{
    size_t n = 0;
    for (; *asked && n + 1 < size; asked++) {
        unsigned value = (unsigned char)*asked;
        if (*asked == '%' && sscanf(asked + 1, "%2x", &value) == 1 && isxdigit((unsigned char)asked[1]) &&
            isxdigit((unsigned char)asked[2]))
            asked += 2;
        if (value < ' ' || value == '/' || value > 255) return false;
        name[n++] = (char)value;
    }
    name[n] = 0;
    return n > 0 && !*asked && name[0] != '.';
}

// The folder of OUT that a path below it begins with, of those whose files are given; "" for OUT itself, NULL: of none.
static const char *folder_of(const char *path)
{
    static const char *const folders[] = {"report", "progress", "video", "export/photos", "export", "clouds", "start"};
    static const char *const files[] = {"index.html", "sheet.png", "views.json", "evaluate.json", "log.jsonl"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        if (strcmp(path, files[i]) == 0) return "";
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        size_t n = strlen(folders[i]);
        if (strncmp(path, folders[i], n) == 0 && path[n] == '/' && !strchr(path + n + 1, '/')) return folders[i];
    }
    return NULL;
}

// Opens a folder below `dir`, step by step, so that no link is followed. -1: there is none.
static int open_folder(const char *dir, const char *folder)
{
    int at = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    while (at >= 0 && *folder) {
        char step[16];
        size_t n = strcspn(folder, "/");
        snprintf(step, sizeof step, "%.*s", (int)n, folder);
        int in = openat(at, step, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        close(at);
        at = in;
        folder += n + (folder[n] == '/');
    }
    return at;
}

// Opens what a request's path means, -1 where that is nothing we give.
static int open_asked(const char *dir, const char *path, off_t *size)
{
    const char *file = strcmp(path, "/") == 0 ? "/index.html" : path;
    const char *folder = *file == '/' ? folder_of(file + 1) : NULL;
    char name[256];
    if (!folder || !get_name(file + 1 + strlen(folder) + (*folder != 0), name, sizeof name)) return -1;
    int in = open_folder(dir, folder), fd = -1;
    if (in >= 0) fd = openat(in, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
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

// more: headers beside those of every answer, each with its line's end.
static void answer(Client *c, const char *status, const char *type, off_t size, const char *more)
{
    c->have = (size_t)snprintf(c->head, sizeof c->head,
                               "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %lld\r\nCache-Control: no-store\r\n"
                               "X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\n"
                               "%sConnection: close\r\n\r\n",
                               status, type, (long long)size, more);
    c->sent = 0;
    c->answering = true;
}

// The value of a header, to the end of its line; NULL where there is none.
static const char *header(const char *head, const char *name)
{
    size_t n = strlen(name);
    for (const char *line = strstr(head, "\r\n"); line; line = strstr(line + 2, "\r\n"))
        if (strncasecmp(line + 2, name, n) == 0 && line[2 + n] == ':')
            return line + 3 + n + strspn(line + 3 + n, " \t");
    return NULL;
}

// The value of the header Host is this machine's own name for itself.
static bool is_host_ours(const char *head)
{
    const char *host = header(head, "Host");
    size_t n = host ? strcspn(host, ":\r ") : 0;
    return n == 9 && (strncasecmp(host, "127.0.0.1", n) == 0 || strncasecmp(host, "localhost", n) == 0);
}

// One range of bytes, "bytes=5-9", "bytes=5-" or "bytes=-5" (the last five). 1: there is one, in the file; 0: none that
// we know, the whole file is the answer; -1: it lies beyond the file.
static int get_range(const char *head, off_t size, off_t *first, off_t *end)
{
    const char *range = header(head, "Range");
    if (!range || strncasecmp(range, "bytes=", 6) != 0 || header(head, "If-Range")) return 0;
    char *at = (char *)range + 6;
    bool last = *at == '-';
    if (!isdigit((unsigned char)at[last])) return 0;
    long long from = strtoll(at + last, &at, 10), to = size - 1; // too large a number stays as large as can be
    if (!last && *at++ != '-') return 0;
    if (!last && isdigit((unsigned char)*at)) to = strtoll(at, &at, 10);
    if (*at != '\r' || (!last && to < from && from < size)) return 0;
    *first = !last ? (off_t)from : from < size ? (off_t)(size - from) : 0;
    *end = last || to >= size ? size : (off_t)to + 1;
    return *first < *end ? 1 : -1;
}

// The whole file, or the range of it that was asked for, as films are.
static void answer_file(Client *c, const char *type, bool head_only)
{
    char more[120] = "Accept-Ranges: bytes\r\n";
    off_t first = 0, end = c->size;
    int range = get_range(c->head, c->size, &first, &end);
    if (range > 0)
        snprintf(more, sizeof more, "Accept-Ranges: bytes\r\nContent-Range: bytes %lld-%lld/%lld\r\n", (long long)first,
                 (long long)end - 1, (long long)c->size);
    if (range < 0) snprintf(more, sizeof more, "Content-Range: bytes */%lld\r\n", (long long)c->size);
    if (range < 0)
        answer(c, "416 Range Not Satisfiable", "text/plain", 0, more);
    else
        answer(c, range ? "206 Partial Content" : "200 OK", type, end - first, more);
    c->at = first;
    c->size = head_only || range < 0 ? c->at : end; // where it ends
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
        if (c->have == sizeof c->head - 1) answer(c, "431 Request Header Fields Too Large", "text/plain", 0, "");
        return;
    }
    char method[16], path[1024];
    int end = 0; // of what is to follow them
    bool whole = sscanf(c->head, "%15s %1023s HTTP/1.%n", method, path, &end) == 2 && end > 0;
    bool get = whole && strcmp(method, "GET") == 0, head_only = whole && strcmp(method, "HEAD") == 0;
    if (!whole) {
        answer(c, "400 Bad Request", "text/plain", 0, "");
    } else if (!get && !head_only) {
        answer(c, "405 Method Not Allowed", "text/plain", 0, "");
    } else if (!is_host_ours(c->head)) {
        answer(c, "403 Forbidden", "text/plain", 0, "");
    } else {
        path[strcspn(path, "?")] = 0;
        c->at = c->size = 0;
        c->file = open_asked(dir, path, &c->size);
        const char *name = strcmp(path, "/") == 0 ? "index.html" : path;
        if (c->file < 0)
            answer(c, "404 Not Found", "text/plain", 0, "");
        else
            answer_file(c, type_of(name), head_only);
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

// False where the system has no more files to give: it will be asked again in a while, not at once.
static bool admit(const Server *server)
{
    Client *client = server->client;
    int s = accept4(server->socket, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC), i = 0;
    if (s < 0) return errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM;
    while (i < CLIENTS && client[i].socket >= 0) i++;
    if (i == CLIENTS) close(s);
    if (i < CLIENTS) client[i] = (Client){.socket = s, .file = -1, .last = fs_clock_seconds()};
    return true;
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
    Client *client = server->client;
    for (int i = 0; i < CLIENTS; i++) client[i] = (Client){.socket = -1, .file = -1};
    double closed_until = 0;
    while (!fs_log_cancelled(log)) {
        struct pollfd list[CLIENTS + 1] = {
            {.fd = fs_clock_seconds() < closed_until ? -1 : server->socket, .events = POLLIN}};
        for (int i = 0; i < CLIENTS; i++)
            list[1 + i] = (struct pollfd){.fd = client[i].socket, .events = client[i].answering ? POLLOUT : POLLIN};
        if (poll(list, CLIENTS + 1, POLL_MS) < 0 && errno != EINTR) break;
        double now = fs_clock_seconds();
        for (int i = 0; i < CLIENTS; i++)
            if (client[i].socket >= 0) attend(server, &client[i], &list[1 + i], now);
        if (list[0].revents && !admit(server)) closed_until = now + POLL_MS / 1000.0;
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
    server->client = malloc(CLIENTS * sizeof *server->client);
    return server->client ? 0 : fs_error_memory(err);
}

void fs_serve_close(Server *server)
{
    if (server->socket >= 0) close(server->socket);
    free(server->client);
    *server = (Server){.socket = -1};
}
