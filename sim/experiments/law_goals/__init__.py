"""Goals of the law with the rotors in its rows: figures of today's QP against those of the QP without them."""
