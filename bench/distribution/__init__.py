"""Work of many like parts, done by processes of this machine or by a cluster; what comes of it does not depend on which."""
