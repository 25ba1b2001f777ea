"""Work in many equal parts, done by processes of this computer or by a cluster; the result does not depend on which."""
