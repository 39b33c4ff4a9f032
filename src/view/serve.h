// A small web server for one page: HTTP/1.1, GET and HEAD, ranges of bytes, on 127.0.0.1 only. It gives what the page
// shows and links to, and nothing else: index.html, sheet.png, the files of figures, and what lies directly in report,
// progress, video, export, export/photos, clouds and start. Nothing through a link, no hidden files. A request whose
// Host is another name is refused, so that no page from elsewhere can make a browser read from here.
#pragma once

#include "base/error.h"
#include "base/log.h"

typedef struct Server {
    int socket, port;
    const char *dir; // borrowed
    struct Client *client;
} Server;

int fs_serve_open(Server *server, const char *dir, int port, FsError *err); // port 0: any free one
void fs_serve_until_cancelled(const Server *server, const Log *log);        // log->cancelled
void fs_serve_close(Server *server);
